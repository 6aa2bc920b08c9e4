"""A plugin in a process of its own: the judge sends arrays and gets arrays, and nothing else goes either way.

`remote` is what the judge calls. It asks a `process`, whose other end is `worker`. Both speak the `messages`, which go
through a `channel`. `hosts` keeps the processes of a run and ends them.
"""
