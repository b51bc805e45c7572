// What points can be coloured by, and the colours.

import {classColour, kPlain, rampColour} from './colour_map.mjs';

const kMeasures = ['curvature', 'range'];  // of the simplification, where an archive carries them
const kSampled = 4000;  // values of a tile that limits are taken from
const kLowest = 0.01, kHighest = 0.99;  // shares of the values below and above the ramp's ends

/// The modes for some archives that are shown together, in the order of the menu. One without fields that an archive
/// lacks is plain there; `missing` is set where no archive has them.
export function colourModes(archives) {
    const fieldNames = new Set(archives.flatMap((archive) => archive.fields.map(({name}) => name)));
    const measure = (name) => ({
        id: name, label: name[0].toUpperCase() + name.slice(1), kind: 'number', names: [name], logarithmic: true,
        missing: fieldNames.has(name) ? '' : 'not in this archive',
    });
    const modes = [
        {id: 'rgb', label: 'Colour (RGB)', kind: 'rgb', names: ['red', 'green', 'blue'],
            missing: ['red', 'green', 'blue'].every((name) => fieldNames.has(name)) ? '' : 'not in this archive'},
        {id: 'height', label: 'Height', kind: 'height', names: [], missing: ''},
        ...kMeasures.map(measure),
        {id: 'plain', label: 'One colour', kind: 'plain', names: [], missing: ''},
    ];
    for (const name of fieldNames) {
        if (kMeasures.includes(name)) continue;
        modes.push({id: `field:${name}`, label: name, kind: name === 'classification' ? 'class' : 'number',
            names: [name], missing: '', attribute: true});
    }
    return modes;
}

/// The fields of an archive that a mode needs; null if it lacks one.
export function fieldsFor(mode, archive) {
    const fields = mode.names.map((name) => archive.fields.find((field) => field.name === name));
    return fields.every(Boolean) ? fields : null;
}

/// A number a point of a tile, as its ramp sees it; null where the mode has none.
function numbersOf(mode, tile, upAxis) {
    if (mode.kind === 'height') {
        return (i) => tile.positions[3 * i + upAxis] + tile.corner[upAxis];
    }
    const field = mode.kind === 'number' ? tile.fields?.get(mode.names[0]) : null;
    if (!field) return null;
    const {values, scale, offset} = field;
    return (i) => values[i] * scale + offset;
}

/// Where the ramp begins and ends for all tiles together, and whether it is logarithmic.
export function limitsOf(mode, tiles, upAxis) {
    const sample = [];
    let largest = 0;
    for (const tile of tiles) {
        const step = Math.max(1, Math.ceil(tile.count / kSampled));
        const numbers = numbersOf(mode, tile, upAxis);
        for (let i = 0; numbers && i < tile.count; i += step) {
            const value = numbers(i);
            if (Number.isFinite(value)) sample.push(value);
        }
        if (mode.kind === 'rgb') {
            for (const {values} of tile.fields?.values() ?? []) {
                largest = values.reduce((most, value) => Math.max(most, value), largest);
            }
        }
    }
    sample.sort((a, b) => a - b);
    const at = (share) => sample[Math.round(share * (sample.length - 1))] ?? 0;
    const low = at(kLowest), high = at(kHighest);
    return {low, high, logarithmic: Boolean(mode.logarithmic) && low > 0 && high > low, white: whiteOf(largest)};
}

/// What white is, by the largest value of all colours: of 16 bits, of 8, or of shares.
function whiteOf(largest) {
    return largest > 255 ? 65535 : largest > 1 ? 255 : 1;
}

/// Fills `tints` with 4 bytes a point.
export function paint(tints, mode, tile, limits, upAxis) {
    const put = (i, [red, green, blue]) => {
        tints[4 * i] = red, tints[4 * i + 1] = green, tints[4 * i + 2] = blue, tints[4 * i + 3] = 255;
    };
    const numbers = numbersOf(mode, tile, upAxis);
    const fields = [...tile.fields?.values() ?? []];
    if (numbers) {
        const onRamp = limits.logarithmic ? Math.log : (value) => value;
        const low = onRamp(limits.low), extent = onRamp(limits.high) - low || 1;
        for (let i = 0; i < tile.count; ++i) put(i, rampColour((onRamp(numbers(i)) - low) / extent));
    } else if (mode.kind === 'rgb' && fields.length === 3) {
        const share = 255 / limits.white;
        const [red, green, blue] = fields.map(({values}) => values);
        for (let i = 0; i < tile.count; ++i) put(i, [red[i] * share, green[i] * share, blue[i] * share]);
    } else if (mode.kind === 'class' && fields.length === 1) {
        for (let i = 0; i < tile.count; ++i) put(i, classColour(fields[0].values[i]));
    } else {
        for (let i = 0; i < tile.count; ++i) put(i, kPlain);
    }
}
