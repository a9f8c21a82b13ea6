"""The parts of an OpenEXR file as OpenImageIO alone reads and writes them."""

import OpenImageIO as oiio


def read_parts(path):
    """Each part's specification and its pixels (H, W, channels) in the file's own type; all are read to their end."""
    source = oiio.ImageInput.open(str(path))
    assert source is not None, oiio.geterror()
    parts = []
    while source.seek_subimage(len(parts), 0):
        spec = source.spec().copy()
        pixels = source.read_image(len(parts), 0, 0, spec.nchannels, oiio.UNKNOWN)
        assert pixels is not None, source.geterror()
        parts.append((spec, pixels))
    source.close()
    return parts


def by_channel(spec, pixels):
    """Channel name -> (H, W) array."""
    return {name: pixels[..., k] for k, name in enumerate(spec.channelnames)}


def write_parts(path, parts):
    """Write what ``read_parts`` gave, changed or not."""
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), tuple(spec for spec, _ in parts)), target.geterror()
    for number, (spec, pixels) in enumerate(parts):
        assert number == 0 or target.open(str(path), spec, "AppendSubimage"), target.geterror()
        assert target.write_image(pixels), target.geterror()
    assert target.close()


def write_tiled(path, pixels, size):
    """Write one image (H, W, channels) in square tiles, uncompressed."""
    spec = oiio.ImageSpec(*pixels.shape[1::-1], pixels.shape[2], oiio.FLOAT)
    spec.tile_width = spec.tile_height = size
    spec.attribute("compression", "none")
    write_parts(path, [(spec, pixels)])
