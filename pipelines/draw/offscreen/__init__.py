"""Three-dimensional pictures, drawn by PyVista in a child process."""
