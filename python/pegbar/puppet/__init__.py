"""From a picture to a moving figure: triangulation, deformation, rendering (2007 paper, s6-7)."""
