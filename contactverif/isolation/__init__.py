"""Child processes for what strangers wrote: plugins, which are asked by messages, and files, which are read there.

`child` starts, limits and ends a process and has a `channel` to it. On it stand `process`, the process of a plugin as
the judge sees it, whose other end is `worker` or any program that speaks the protocol, and `file_reader`.
"""
