"""Files of textures and numbers, whole or absent: EXR, images of other renderers, NPY, pictures, sRGB.

``whole`` writes files and reads text; ``exr`` writes textures, ``image_file`` reads them; ``npy`` holds arrays;
``pictures`` and ``srgb`` make what a screen shows.
"""
