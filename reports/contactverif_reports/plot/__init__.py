"""Pictures of cases, scenes and benches: text for a terminal, figures for a paper, files for ParaView.

Rule: a picture may be rough where a judge may not; nothing here is used for a verdict. matplotlib is slow to import:
only the modules of figures do.
"""
