"""From one picture to a figure that moves (2007 paper, s6-7): template, layers, textures, deformation, rendering."""
