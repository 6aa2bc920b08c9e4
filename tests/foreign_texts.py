"""Texts that a plugin or a file may bring, and what must never be shown of them."""

TEXTS = {
    "escape": "a\x1b[31mred\x1b]0;title\x07",
    "control": "a\rb\bc\x00d\x7fe\x9b31m",
    "lines": "a\nEvery promise is kept and every property was judged.\n\n",
    "bidirectional": "a\u202ecba\u2066d",
    "unseen": "a\u200bb\u200dc\ufeffd\ufe0f\U000e0001",
    "looks": "nts\u2011ar",
    "marks": "e" + "\u0301" * 300,
    "surrogate": "a\ud800b\udc80",
    "markup": "[bold red]a[/x] [link=http://x]b[/link] :warning: [/]",
    "html": "<script>alert(1)</script>&amp;\"'",
    "formula": r"$\frac{a$ $b$ \\ $$",
    "long": "x" * 300_000,
}
_HIDDEN = [chr(code) for code in [*range(32), *range(127, 160)] if chr(code) != "\n"]
_HIDDEN += ["\u0301" * 3, *"\u2011\u200b\u200d\u202e\u2066\ufeff\ufe0f\U000e0001\ud800\udc80"]


def hidden_characters(text: str) -> list[str]:
    """Return the characters of a text that a terminal obeys, or that nobody sees."""
    return [character for character in _HIDDEN if character in text]
