"""Many takes: from a command line to outputs that are whole, with their records.

A command line becomes a `Batch` (``batch``); that and a manifest become a list of
`Task` (``manifest``, ``plan``), settled as a whole before anything is done. A worker
(``workers``) does one task at a time (``execute``): it takes the digests of all that
will be read, begins the record of what will be made (``provenance``), looks at what
stands where the outputs belong (``outputs``), and only then calls the step of the
command, which hands back an `Outcome` (``outcome``). What came of it is a `Report`;
``many`` puts the reports in the order of the inputs, ``console`` tells them, and they
make the exit status.

Why not ``concurrent.futures``: its pool breaks as a whole when one process dies, and
one take that is too big for the memory must not stop the other thousand. Workers are
fresh interpreters (spawned, not forked), as compiled libraries do not survive a fork
with their threads; with more than one input even one job runs in a worker, so that
results and isolation do not depend on ``--jobs``.

A cluster (``cluster``, by Dask's ``dask_client``) does tasks in the same processes
(``process``): each thread of its workers (``on_worker``) has one. Why not in the
workers themselves: a take that crashes would take others along, and a task of Dask's
that runs cannot be stopped. Why tasks are given to workers here, not by Dask's
scheduler: only so is it known which were being done where a worker was lost, and which
only waited.

Why figures and the line stand in the record: a rerun that skips an input says the
same about it, and ``--require`` holds for it too.
"""
