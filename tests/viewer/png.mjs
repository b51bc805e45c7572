// Reads the pictures that a browser takes: PNG, 8 bits a channel, not interlaced.

import assert from 'node:assert/strict';
import {inflateSync} from 'node:zlib';

const kSignature = 8;
const kChannels = {2: 3, 6: 4};  // by colour type

/// @return {width, height, at(x, y)}: at gives [red, green, blue]
export function readPng(bytes) {
    let header;
    const parts = [];
    for (let at = kSignature; at < bytes.length;) {
        const size = bytes.readUInt32BE(at);
        const kind = bytes.toString('latin1', at + 4, at + 8);
        const content = bytes.subarray(at + 8, at + 8 + size);
        if (kind === 'IHDR') header = content;
        if (kind === 'IDAT') parts.push(content);
        at += size + 12;
    }
    const width = header.readUInt32BE(0), height = header.readUInt32BE(4);
    const channels = kChannels[header[9]];
    assert.ok(channels && header[8] === 8 && header[12] === 0, 'a PNG as browsers write it');
    const pixels = unfilter(inflateSync(Buffer.concat(parts)), width * channels, height, channels);
    return {width, height, at: (x, y) => {
        const first = (y * width + x) * channels;
        return [pixels[first], pixels[first + 1], pixels[first + 2]];
    }};
}

function unfilter(raw, stride, height, channels) {
    const pixels = Buffer.alloc(stride * height);
    for (let y = 0; y < height; ++y) {
        const filter = raw[y * (stride + 1)];
        for (let k = 0; k < stride; ++k) {
            const to = y * stride + k;
            const left = k >= channels ? pixels[to - channels] : 0;
            const above = y > 0 ? pixels[to - stride] : 0;
            const corner = y > 0 && k >= channels ? pixels[to - stride - channels] : 0;
            const guess = [0, left, above, (left + above) >> 1, paeth(left, above, corner)][filter];
            pixels[to] = raw[y * (stride + 1) + 1 + k] + guess;
        }
    }
    return pixels;
}

function paeth(left, above, corner) {
    const guess = left + above - corner;
    const [a, b, c] = [left, above, corner].map((value) => Math.abs(guess - value));
    return a <= b && a <= c ? left : b <= c ? above : corner;
}
