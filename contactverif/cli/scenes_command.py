"""The command `scenes`: the scenes that have a name."""

from __future__ import annotations


def scenes() -> None:
    """List the named scenes, with drawings, and their options.

    A scene with options is written NAME:OPTION=VALUE,OPTION=VALUE.

    \bExit status
      0  listed

    \bExamples
      contactverif scenes
      contactverif draw --scene b -f vts-me -f vts-ppt --out b.png
      contactverif verify vts-ppt --scene c-prime:refine=4 -p 'patch.*'
    """
    from contactverif.cli.console import show
    from contactverif.cli.gallery import Gallery

    show(Gallery())
