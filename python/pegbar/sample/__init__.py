"""The sample shot: a procedural dancer with a hoop and a ribbon, drawn and rendered from nothing."""
