"""The experiments behind the method, each with its question, as lists in Markdown.

python tools/notebook.py        # prints what the manual's page "Notebook" shows
"""

import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "experiments"


def markdown() -> str:
    """Return a line for each page of `docs/experiments`: its title, which leads there, and its question."""
    return "\n".join(
        f"- [{title}](experiments/{path.name}): {question}"
        for path in sorted(FOLDER.glob("*.md"))
        for title, question in [title_and_question(path.read_text(encoding="utf-8"))]
    )


def title_and_question(text: str) -> tuple[str, str]:
    """Return the title of a page and the first paragraph of its question, on one line each."""
    title = text.partition("\n")[0].removeprefix("# ")
    question = text.partition("## Question\n")[2].strip().split("\n\n")[0]
    return title, " ".join(question.split())


if __name__ == "__main__":
    sys.stdout.write(markdown() + "\n")
