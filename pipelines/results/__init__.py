"""Result files: VTK, CSV and the folder that holds them."""
