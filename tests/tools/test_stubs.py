"""Tests of the stub file of the compiled core."""

from tools.stubs import function, quoted


def test_a_signature_and_its_docstring_become_source() -> None:
    written = function(
        "take(self: smokelift._core.Marked, at: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | "
        'typing.SupportsIndex], "FixedSize(3)"], values: typing.Annotated[numpy.typing.ArrayLike, numpy.float32]) '
        "-> smokelift._core.Marked\n\nTake them.\n\n        The rest stays.\n"
    )
    assert written == (
        "def take(self, at: npt.ArrayLike, values: Reals) -> Marked:\n"
        '    """Take them.\n\n    The rest stays.\n    """\n'
    )


def test_what_says_nothing_has_an_empty_body() -> None:
    assert function("__init__(self: Blocks) -> None\n") == "def __init__(self) -> None:\n    ...\n"
    assert quoted("One line.") == '"""One line."""'
