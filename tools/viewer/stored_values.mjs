// Numbers out of what Draco's decoder gives: values that Draco does not code without loss are stored in parts of 16
// bits, the lowest first (docs/formats.md).

const kParts = {int32: 2, uint32: 2, float32: 2, int64: 4, uint64: 4, float64: 4};

/// The array that the decoder is asked for: parts of 64-bit values, else the values' own type.
export function arrayTypeOf(type) {
    return {
        int8: 'Int8Array', uint8: 'Uint8Array', int16: 'Int16Array', uint16: 'Uint16Array', int32: 'Int32Array',
        uint32: 'Uint32Array', float32: 'Float32Array', int64: 'Uint16Array', uint64: 'Uint16Array',
        float64: 'Uint16Array',
    }[type];
}

/// One component of an attribute, a number a point.
/// @param decoded  {array, itemSize, stride, count}: itemSize numbers a point, `stride` apart
/// @param stored   {type, components} of the attribute in the manifest
export function componentOf(decoded, stored, component) {
    const {array, itemSize, stride, count} = decoded;
    const wide = stored.type.endsWith('64') || stored.type.endsWith('int32');
    const values = wide ? new Float64Array(count) : new Float32Array(count);
    const parts = itemSize / stored.components;
    if (parts === 1) {
        for (let i = 0; i < count; ++i) values[i] = array[i * stride + component];
        return values;
    }
    if (parts !== kParts[stored.type]) {
        throw new Error(`expected ${stored.components} values of ${stored.type}, found ${itemSize} parts`);
    }
    const view = new DataView(new ArrayBuffer(8));
    const read = readerOf(view, stored.type);
    for (let i = 0; i < count; ++i) {
        for (let part = 0; part < parts; ++part) {
            view.setUint16(2 * part, array[i * stride + component * parts + part], true);
        }
        values[i] = read();
    }
    return values;
}

function readerOf(view, type) {
    switch (type) {
        case 'int32': return () => view.getInt32(0, true);
        case 'uint32': return () => view.getUint32(0, true);
        case 'float32': return () => view.getFloat32(0, true);
        case 'float64': return () => view.getFloat64(0, true);
        case 'int64': return () => Number(view.getBigInt64(0, true));
        default: return () => Number(view.getBigUint64(0, true));
    }
}
