"""Models that networks on maps are compared with, and that nobody should serve for their accuracy.

`unet`: the U-Net as it was published, which `train` trains. `untrained`: a half-space in closed
form and the finger's own linear operator, which need no training. The rest of the package
compresses an operator and puts it into a graph that works at the vertices of the atlas.
"""
