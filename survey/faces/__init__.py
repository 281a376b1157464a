"""Stone faces: measured points → robust plane → outline."""
