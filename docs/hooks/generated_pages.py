"""The pages of the site that are made when it is built: mkdocs calls the three functions at the end.

A page is made here if its facts live elsewhere, in the installed program or in a file of the repository, so that the
site cannot disagree with them. Rules for the next editor:

- Nothing is written into docs/. A page is a pair of its path in the site and its Markdown text.
- No formulation and no property is named here: what is installed decides which pages there are.
"""

from __future__ import annotations

import logging
import re
from pathlib import Path
from typing import Any

from command_pages import command_page
from formulation_page import formulation_page
from mkdocs.structure.files import File, Files
from paper_pages import paper_figures, paper_page
from property_pages import property_index, property_page
from repository_pages import repository_pages, repository_pictures

from contactverif import Property, load_properties
from contactverif.plugins.registry import load_formulations

ROOT = Path(__file__).parents[2]
PROPERTY_FOLDER = "reference/properties/"
FOREIGN = re.compile(
    r"""<(?:script|img|iframe|source)[^>]*\bsrc="(?:https?:)?//|<link[^>]*rel="stylesheet"[^>]*href="(?:https?:)?//"""
)
log = logging.getLogger("mkdocs.hooks.generated_pages")


def installed_properties() -> list[Property]:
    """Return the installed properties, sorted by id; warn about one that does not load."""
    items = load_properties()
    for item in items:
        if not isinstance(item, Property):
            log.warning("a property did not load: %s", item)
    return [item for item in items if isinstance(item, Property)]


def pages() -> dict[str, str]:
    """Return {path in the site: Markdown text} of all pages that are made."""
    properties = installed_properties()
    formulations = load_formulations()
    texts = {f"{PROPERTY_FOLDER}{item.id}.md": property_page(item, formulations) for item in properties}
    texts[f"{PROPERTY_FOLDER}index.md"] = property_index(properties, ROOT)
    texts["reference/command-line.md"] = command_page()
    texts["reference/formulations.md"] = formulation_page(ROOT)
    texts["paper/index.md"] = paper_page(ROOT)
    return texts | repository_pages(ROOT)


def on_config(config: Any) -> Any:
    """Put one page for each installed property into the navigation."""
    entries = [f"{PROPERTY_FOLDER}index.md"]
    entries += [{item.id: f"{PROPERTY_FOLDER}{item.id}.md"} for item in installed_properties()]
    for section in config.nav:
        for items in section.values():
            for item in items:
                if isinstance(item, dict) and PROPERTY_FOLDER in item.values():
                    item.update(dict.fromkeys(item, entries))
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are made, and the pictures that they show."""
    for path, text in pages().items():
        files.append(File.generated(config, path, content=text))
    for path, source in (paper_figures(ROOT) | repository_pictures(ROOT)).items():
        files.append(File.generated(config, path, abs_src_path=str(source)))
    return files


def on_post_page(output: str, page: Any, config: Any) -> str:
    """Warn if a page fetches something from a network."""
    for match in FOREIGN.finditer(output):
        log.warning("%s fetches from a network: %s", page.file.src_uri, match[0])
    return output
