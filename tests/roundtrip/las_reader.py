"""LAS 1.0 to 1.5, point formats 0 to 10; of LAZ the header, the points by way of LASzip's unlaz."""

import struct

import numpy as np

from roundtrip.cloud import Cloud, Column, Grid

SHORT = [("x", "<i4"), ("y", "<i4"), ("z", "<i4"), ("intensity", "<u2"), ("bits", "u1"),
         ("class", "u1"), ("scan_angle_rank", "i1"), ("user_data", "u1"), ("point_source_id", "<u2")]
LONG = [("x", "<i4"), ("y", "<i4"), ("z", "<i4"), ("intensity", "<u2"), ("returns", "u1"),
        ("flags", "u1"), ("classification", "u1"), ("user_data", "u1"), ("scan_angle", "<i2"),
        ("point_source_id", "<u2"), ("gps_time", "<f8")]
TIME = [("gps_time", "<f8")]
COLOUR = [("red", "<u2"), ("green", "<u2"), ("blue", "<u2")]
INFRARED = [("near_infrared", "<u2")]
WAVE = [("wave", "V29")]
FORMATS = {0: SHORT, 1: SHORT + TIME, 2: SHORT + COLOUR, 3: SHORT + TIME + COLOUR,
           4: SHORT + TIME + WAVE, 5: SHORT + TIME + COLOUR + WAVE, 6: LONG, 7: LONG + COLOUR,
           8: LONG + COLOUR + INFRARED, 9: LONG + WAVE, 10: LONG + COLOUR + INFRARED + WAVE}
# Of each packed byte: name, lowest bit, number of bits.
BITS = {"bits": [("return_number", 0, 3), ("number_of_returns", 3, 3), ("scan_direction", 6, 1),
                 ("edge_of_flight_line", 7, 1)],
        "class": [("classification", 0, 5), ("synthetic", 5, 1), ("key_point", 6, 1),
                  ("withheld", 7, 1)],
        "returns": [("return_number", 0, 4), ("number_of_returns", 4, 4)],
        "flags": [("synthetic", 0, 1), ("key_point", 1, 1), ("withheld", 2, 1), ("overlap", 3, 1),
                  ("scanner_channel", 4, 2), ("scan_direction", 6, 1), ("edge_of_flight_line", 7, 1)]}
EXTRA = ["u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f4", "<f8"]


def text(raw):
    return raw.split(b"\0")[0].decode("utf-8", "surrogateescape")


def read_records(data, at, count, extended):
    records = []
    for _ in range(count):
        user, number = text(data[at + 2:at + 18]), struct.unpack_from("<H", data, at + 18)[0]
        length, = struct.unpack_from("<Q" if extended else "<H", data, at + 20)
        head = 60 if extended else 54
        description = text(data[at + head - 32:at + head])
        at += head
        records.append((user, number, description, extended, data[at:at + length]))
        at += length
    return records


def is_of_the_file(user, number):
    """Does a record tell how this very file is stored?"""
    return (user in ("laszip encoded", "copc") or (user == "LAStools" and number == 30)
            or (user == "LASF_Spec" and (number == 4 or 100 <= number < 355 or number == 65535)))


def extra_columns(record):
    """(name, type, components, scales, offsets, description) of each descriptor."""
    for at in range(0, len(record) // 192 * 192, 192):
        item = record[at:at + 192]
        kind, options = item[2], item[3]
        name, description = text(item[4:36]), text(item[160:192])
        if kind == 0:
            yield name, "u1", options, [1.0], [0.0], description
            continue
        components = (kind - 1) // 10 + 1
        scales = struct.unpack_from("<3d", item, 112)[:components]
        offsets = struct.unpack_from("<3d", item, 136)[:components]
        yield (name, EXTRA[(kind - 1) % 10], components,
               list(scales) if options & 8 else [1.0] * components,
               list(offsets) if options & 16 else [0.0] * components, description)


def extra_bytes(rows, at, length, record):
    columns = []
    for name, kind, components, scales, offsets, description in extra_columns(record):
        size = np.dtype(kind).itemsize * components
        if size == 0 or at + size > length:
            break
        values = rows[:, at:at + size].copy().view(kind)
        if len(set(scales)) > 1 or len(set(offsets)) > 1:
            columns += [Column(f"{name}[{i}]", values[:, i], scales[i], offsets[i], description)
                        for i in range(components)]
        else:
            values = values[:, 0] if components == 1 else values
            columns.append(Column(name, values, scales[0], offsets[0], description))
        at += size
    if at < length:
        rest = rows[:, at:length]
        columns.append(Column("extra_bytes", rest[:, 0] if at + 1 == length else rest))
    return columns


def read_las(data, points=None):
    """`points`: of LAZ, the same file as LAS, whose points are taken."""
    minor, head_size = data[25], struct.unpack_from("<H", data, 94)[0]
    form, = struct.unpack_from("<B", data, 104)
    record_count, = struct.unpack_from("<I", data, 100)
    records = read_records(data, head_size, record_count, False)
    if minor >= 4:
        begin, count = struct.unpack_from("<QI", data, 235)
        records += read_records(data, begin, count, True)
    plain = data if points is None else points
    start, = struct.unpack_from("<I", plain, 96)
    length, legacy = struct.unpack_from("<HI", plain, 105)
    total = struct.unpack_from("<Q", plain, 247)[0] if plain[25] >= 4 else legacy
    layout = np.dtype(FORMATS[form & 63])
    rows = np.frombuffer(plain, np.uint8, total * length, start).reshape(total, length)
    core = np.ascontiguousarray(rows[:, :layout.itemsize]).view(layout)[:, 0]
    columns = []
    for name, _ in FORMATS[form & 63]:
        if name in BITS:
            columns += [Column(part, core[name] >> shift & (1 << width) - 1)
                        for part, shift, width in BITS[name]]
        elif name == "scan_angle":
            columns.append(Column(name, core[name], 0.006))
        elif name not in ("x", "y", "z", "wave"):
            columns.append(Column(name, core[name]))
    described = b"".join(r[4][:len(r[4]) // 192 * 192] for r in records if r[:2] == ("LASF_Spec", 4))
    columns += extra_bytes(rows, layout.itemsize, length, described)
    scale, offset = (np.array(struct.unpack_from("<3d", data, at)) for at in (131, 155))
    index = np.stack([core[axis] for axis in "xyz"], axis=1)
    source, encoding = struct.unpack_from("<HH", data, 4)
    day, year = struct.unpack_from("<HH", data, 90)
    lost = ["waveform packets"] if form & 63 in (4, 5, 9, 10) else []
    return Cloud(index * scale + offset, columns, Grid(index, scale, offset),
                 [r for r in records if not is_of_the_file(r[0], r[1])],
                 {"file source": source, "encoding": encoding & ~0b110, "project": data[8:24],
                  "system": text(data[26:58]), "day": day, "year": year},
                 lost)
