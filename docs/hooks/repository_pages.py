"""Pages whose text is a Markdown file of the repository, with its links turned to the pages of the site."""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

# {file in the repository: page in the site}
PAGES = {
    "reports/README.md": "reference/report.md",
    "reports/stability/README.md": "reference/stability.md",
    "reports/trust/README.md": "reference/trust.md",
    "reports/trust/bugs.md": "reference/mistakes.md",
    "reports/trust/hostile.md": "reference/hostile-plugins.md",
    "reports/bench/README.md": "reference/speed-against-error.md",
    "reports/findings/README.md": "reference/findings.md",
    "reports/findings/engines.md": "reference/engines.md",
    "reports/findings/libraries.md": "reference/libraries.md",
    "CONTRIBUTING.md": "project/contributing.md",
    "DECISIONS.md": "project/decisions.md",
    "CHANGELOG.md": "project/changelog.md",
}
# What other files of the repository are called in the site.
HOMES = PAGES | {
    "README.md": "index.md",
    "plugins/README.md": "reference/formulations.md",
    "properties/README.md": "reference/properties/index.md",
    "reports/paper/README.md": "paper/index.md",
}
_LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)\s]+)\)")


def relink(text: str, path: str) -> str:
    """Return the Markdown of a file of the repository with links that hold in the site.

    A link to a file that is no page of the site becomes plain text.
    """
    here = posixpath.dirname(HOMES[path])

    def replace(match: re.Match[str]) -> str:
        words, target = match[1], match[2]
        if target.startswith(("http", "#", "mailto:")):
            return match[0]
        name, _, anchor = target.partition("#")
        file = posixpath.normpath(posixpath.join(posixpath.dirname(path), name))
        page = file.removeprefix("docs/") if file.startswith("docs/") and file.endswith(".md") else HOMES.get(file)
        if page is None:
            return words
        return f"[{words}]({posixpath.relpath(page, here)}{'#' + anchor if anchor else ''})"

    return _LINK.sub(replace, text)


def repository_pictures(root: Path) -> dict[str, Path]:
    """Return {path in the site: file} of the pictures that stand beside these Markdown files."""
    return {
        posixpath.join(posixpath.dirname(page), picture.name): picture
        for path, page in PAGES.items()
        for picture in sorted((root / path).parent.glob("*.svg"))
    }


def repository_pages(root: Path) -> dict[str, str]:
    """Return {path in the site: Markdown text}."""
    return {page: relink((root / path).read_text(encoding="utf-8"), path) for path, page in PAGES.items()}
