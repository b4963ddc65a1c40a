"""The one error that bad input raises."""


class InputError(ValueError):
    """One sentence that says what is wrong with the user's input and where."""
