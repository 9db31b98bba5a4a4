"""Fuzzed: TRC, CSV, TSV, MOT, readings of gloves as CSV, and manifests."""

import os
import tempfile

import numpy as np

from handclean.errors import HandcleanError
from handclean.io import files
from handclean.io.glove.readings import head_of, open_readings
from handclean.io.glove.write_readings import write_readings
from handclean.io.text.csv_write import write_csv
from handclean.io.text.mot import inspect_mot, write_mot
from handclean.io.text.trc_write import write_trc
from handclean.recording import Motion, Points, Recording, trajectories
from handclean.runner import manifest
from tests.fuzz.inputs import TEXT, Reader
from tests.io.text import vendor_files


def a_take():
    rng = np.random.default_rng(0)
    positions = rng.normal(size=(9, 3, 3))
    positions[2:4, 1] = np.nan
    turns = rng.normal(size=(9, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    return Recording(
        rate=120.0,
        frames=9,
        first_frame=50,
        start_time=2.345,
        markers=trajectories(positions, ("R_A", "R_B", "C")),
        unlabelled=Points(
            frame=np.array([0, 5], np.int32),
            source=np.array([-1, -1], np.int32),
            positions=rng.normal(size=(2, 3)),
        ),
        motions={
            "right": Motion(
                names=("index_pip_flexion",),
                angles=rng.normal(size=(9, 1)),
                translation=rng.normal(size=(9, 3)),
                rotation=turns,
            )
        },
    )


ROWS = [f"{10 + k}.5,20.25,30.125,,,," for k in range(9)]
HEADER = "A_X,A_Y,A_Z,B_X [mm],B_Y [mm],B_Z [mm],B_vel_X"
TABLES = {
    "plain": [HEADER, *ROWS],
    "timed": [
        f"frame,time,{HEADER}",
        *(f"{k},{8.3 * k},{r}" for k, r in enumerate(ROWS)),
    ],
    "pandas": ["bodyparts,A,A,A,B,B,B,B", "coords,x,y,z,x,y,z,likelihood"]
    + [f"{k},{row}" for k, row in enumerate(ROWS)],
    "spread": ["Frame;A;;;B;;;", ";X;Y;Z;X;Y;Z;q", ";mm;mm;mm;mm;mm;mm;"]
    + [f"{k},{row}".replace(",", ";") for k, row in enumerate(ROWS)],
}


def trc_seeds(folder):
    write_trc(folder / "own.trc", a_take(), unnamed=True)
    text = (folder / "own.trc").read_text().replace("handclean.trc", "x.trc")
    (folder / "other.trc").write_text(text)
    lines = text.splitlines()
    raw = [*lines[:3], "Frame#\tTime\t", "\t\t", "", *lines[6:]]
    (folder / "raw.trc").write_text("\r\n".join(raw))
    (folder / "blanks.trc").write_text(text.replace("\t", " "))
    (folder / "commas.trc").write_text(text.replace("\t", ","))
    (folder / "decimal.trc").write_text(text.replace(".", ","))


def csv_seeds(folder):
    write_csv(folder / "own.csv", a_take())
    for name, lines in TABLES.items():
        (folder / f"{name}.csv").write_text("\n".join([*lines, ""]))


def vendor_seeds(folder):
    for make in (vendor_files.nexus, vendor_files.motive):
        for seed in range(8):
            text, _ = make(np.random.default_rng(seed))
            (folder / f"{make.__name__}{seed}.csv").write_text(text)
    bare = [f"{k},{k / 120:.5f},{row}" for k, row in enumerate(ROWS)]
    (folder / "bare.csv").write_text("\n".join([row[:-1] for row in bare]))


def tsv_seeds(folder):
    head = ["NO_OF_FRAMES\t9", "FREQUENCY\t120", "EVENT\tgrasp\t2\t0.01"]
    head += ["MARKER_NAMES\tA\tB", "TRAJECTORY_TYPES\tMeasured\tMixed"]
    names = "Frame\tTime\tA X\tA Y\tA Z\tB X\tB Y\tB Z"
    rows = [f"{k + 1}\t{k / 120:.5f}\t1\t2\t3\t4\tNULL\t6" for k in range(9)]
    (folder / "qualisys.tsv").write_text("\n".join([*head, names, *rows, ""]))
    (folder / "bare.tsv").write_text("\n".join([names, *rows, ""]))
    (folder / "numbers.tsv").write_text("\n".join([*rows, ""]))
    six = "Frame\tTime\tCup X\tCup Y\tCup Z\tRoll\tPitch\tYaw\tResidual\tRot[0]"
    bodies = [*head[:2], "NO_OF_BODIES\t1", "BODY_NAMES\tCup", six, rows[0]]
    (folder / "bodies.tsv").write_text("\n".join([*bodies, ""]))


def glove_seeds(folder):
    rng = np.random.default_rng(0)
    times, values = np.arange(20) / 60.0, rng.uniform(0, 255, (20, 3))
    values[4, 1] = np.nan
    facts = {"glove": "mine", "moved": "A+B", "rate_hz": 60}
    write_readings(folder / "own.csv", times, values, ("A", "B", "C"), facts)
    rows = [",".join(map(str, row)) for row in np.round(values, 2).tolist()]
    (folder / "bare.csv").write_text("\n".join([*rows, ""]))
    timed = [f"{k},{10 * k},{row}" for k, row in enumerate(rows)]
    (folder / "other.csv").write_text("\n".join(["Frame,Time (ms),A,B,C", *timed, ""]))


def manifest_seeds(folder):
    table = "input,output,subject,side\na.c3d,b.h5,s.h5;t.h5,both\nc.c3d,,,left\n"
    (folder / "table.csv").write_text(table)
    (folder / "list.txt").write_text("a.c3d\nb c.c3d\n\n\u00e4.trc\n")
    (folder / "lines.jsonl").write_text(
        '{"input": "a.c3d", "output": "b.h5", "status": "done"}\n'
        '{"input": "c.c3d", "output": "d.h5", "status": "failed"}\n'
    )


def mot_seeds(folder):
    write_mot(folder / "own.mot", a_take())


def read_take(path):
    """Read as inspect does, then as the steps do, then write what was read."""
    read = False
    for given in ({}, {"rate_hz": 120.0, "unit": "mm"}):
        try:
            files.inspect(path, **given)
            take = files.read(path, lenient=bool(given), **given)
            with tempfile.TemporaryDirectory() as folder:
                for suffix in (".csv", ".trc"):
                    files.write(f"{folder}/a{suffix}", take, unnamed=True)
            read = True
        except HandcleanError as error:
            wrong = error
    if not read:
        raise wrong


def read_glove(path):
    head_of(path, 3)
    open_readings(path, sensors=3, rate_hz=60.0).all()


def read_manifest(path):
    manifest.read(os.fspath(path))


READERS = {
    "trc": Reader(read=read_take, seeds=trc_seeds, mutators=TEXT),
    "csv": Reader(read=read_take, seeds=csv_seeds, mutators=TEXT),
    "vendors": Reader(read=read_take, seeds=vendor_seeds, mutators=TEXT),
    "tsv": Reader(read=read_take, seeds=tsv_seeds, mutators=TEXT),
    "mot": Reader(read=inspect_mot, seeds=mot_seeds, mutators=TEXT),
    "glove_csv": Reader(read=read_glove, seeds=glove_seeds, mutators=TEXT),
    "manifest": Reader(read=read_manifest, seeds=manifest_seeds, mutators=TEXT),
}
