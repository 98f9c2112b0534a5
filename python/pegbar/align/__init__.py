"""Which frames of a clip go with which drawn frames, and from where the clip is seen."""
