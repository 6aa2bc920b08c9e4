"""The text that explains a property or a term, in Markdown: a page of the site, and what `explain` prints.

What text and tables tell stands in docs/concepts and reports/trust. This folder has links to these files, and a wheel
has the files themselves.
"""
