"""Published optimal control problems: their statements, our solves of them, and the peers' beside ours."""
