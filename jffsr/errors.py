"""The one exception that users see when their input is at fault."""


class InputError(ValueError):
    """One sentence that says what is wrong with the user's input and where."""
