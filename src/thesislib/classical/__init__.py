"""The older methods of chapter 2, small enough to be read beside its text."""
