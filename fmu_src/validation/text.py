"""Foreign text on its way to a terminal or into a report."""

from __future__ import annotations

MOST = 2000  # characters of one message


def printable(text: str) -> str:
    """Without characters that control a terminal, turn the direction of writing, or cannot be in XML; "?" for each.
    Nor are there more than MOST: the middle is left out.
    """
    if len(text) > MOST:
        text = f"{text[: MOST // 2]} … {text[-MOST // 2 :]}"
    return "".join(character if character.isprintable() or character in "\n\t" else "?" for character in text)
