"""What commands do, without files: functions that take and give the session's types.

`handclean` offers the functions that users call; commands read, call the same
functions, and write.
"""
