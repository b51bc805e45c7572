// Decodes the tiles of an archive with the decoder that Draco's authors publish for JavaScript, which shares no
// code with knap's reader, and holds positions and attributes to the source, bit by bit.
//
//   node tests/viewer/draco3d_test.mjs KNAP FOLDER    FOLDER/node_modules has draco3d

import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

const [knap, modules] = process.argv.slice(2);
const draco3d = createRequire(join(modules, 'package.json'))('draco3d');

// Every type that a PLY has, by the length of a value and how it is written.
const kTypes = {
    char: ['int8', 1, 'setInt8'], uchar: ['uint8', 1, 'setUint8'], short: ['int16', 2, 'setInt16'],
    ushort: ['uint16', 2, 'setUint16'], int: ['int32', 4, 'setInt32'], uint: ['uint32', 4, 'setUint32'],
    float: ['float32', 4, 'setFloat32'], double: ['float64', 8, 'setFloat64'],
};

// A generator of its own, so that every run sees the same.
let state = 1n;
function random() {
    state = (state * 6364136223846793005n + 1442695040888963407n) & 0xffffffffffffffffn;
    return Number(state >> 40n) / 2 ** 24;
}

function randomValue(type, whole) {
    const [, size] = kTypes[type];
    if (type === 'float' || type === 'double') {
        return (random() - 0.5) * 2 ** Math.floor(random() * 60 - 30);
    }
    const range = 2 ** (8 * size);
    const value = Math.floor(random() * (whole ? range : 5));
    return type.startsWith('u') || !whole ? value : value - range / 2;
}

// A sphere whose points stand on whole steps of 2^-10, each in a place of its own.
function makeCloud(count) {
    const attributes = [];
    for (const name of ['red', 'green', 'blue']) attributes.push([name, 'uchar']);
    for (const name of ['nx', 'ny', 'nz']) attributes.push([name, 'float']);
    for (const type of Object.keys(kTypes)) {
        attributes.push([`any_${type}`, type], [`few_${type}`, type]);
    }
    const stride = 12 + attributes.reduce((sum, [, type]) => sum + kTypes[type][1], 0);
    const view = new DataView(new ArrayBuffer(count * stride));
    const points = new Map();
    for (let i = 0; i < count; ++i) {
        const z = 2 * random() - 1, angle = 2 * Math.PI * random(), r = Math.sqrt(1 - z * z);
        const position = [r * Math.cos(angle), r * Math.sin(angle), z].map((c) => Math.round(c * 1024) / 1024);
        let at = i * stride;
        for (const c of position) view.setFloat32(at, c, true), at += 4;
        const values = new Map();
        for (const [name, type] of attributes) {
            const [, size, set] = kTypes[type];
            view[set](at, randomValue(type, name.startsWith('any')), true);
            values.set(name, Buffer.from(view.buffer, at, size).toString('hex'));
            at += size;
        }
        // Of coincident points the first is the one that may be kept.
        if (!points.has(position.join())) points.set(position.join(), values);
    }
    const header = ['ply', 'format binary_little_endian 1.0', `element vertex ${count}`,
        ...['x', 'y', 'z'].map((axis) => `property float ${axis}`),
        ...attributes.map(([name, type]) => `property ${type} ${name}`), 'end_header', ''].join('\n');
    return {bytes: Buffer.concat([Buffer.from(header), Buffer.from(view.buffer)]), points, attributes};
}

const draco = await draco3d.createDecoderModule({});
const kStored = new Map([
    [draco.DT_INT8, 1], [draco.DT_UINT8, 1], [draco.DT_INT16, 2], [draco.DT_UINT16, 2], [draco.DT_INT32, 4],
    [draco.DT_UINT32, 4], [draco.DT_FLOAT32, 4],
]);

function decodeTile(bytes) {
    const buffer = new draco.DecoderBuffer();
    buffer.Init(new Int8Array(bytes), bytes.length);
    const decoder = new draco.Decoder();
    const cloud = new draco.PointCloud();
    const status = decoder.DecodeBufferToPointCloud(buffer, cloud);
    assert.ok(status.ok(), status.error_msg());
    const querier = new draco.MetadataQuerier();
    const attributes = [];
    for (let i = 0; i < cloud.num_attributes(); ++i) {
        const attribute = decoder.GetAttribute(cloud, i);
        const metadata = decoder.GetAttributeMetadata(cloud, i);
        const size = kStored.get(attribute.data_type()) * attribute.num_components();
        const total = size * cloud.num_points();
        const pointer = draco._malloc(total);
        assert.ok(decoder.GetAttributeDataArrayForAllPoints(cloud, attribute, attribute.data_type(), total, pointer));
        attributes.push({
            kind: attribute.attribute_type(),
            stored: attribute.data_type(),
            name: querier.GetStringEntry(metadata, 'name'),
            type: querier.GetStringEntry(metadata, 'type'),
            size,
            values: Buffer.from(draco.HEAPU8.slice(pointer, pointer + total)),
        });
        draco._free(pointer);
    }
    return {count: cloud.num_points(), attributes};
}

function checkTile(tile, entry, lattice, cloud, expectedKinds) {
    const found = decodeTile(tile);
    assert.equal(found.count, entry.points);
    const [positions, ...others] = found.attributes;
    assert.equal(positions.kind, draco.POSITION);
    const kinds = others.map((attribute) => attribute.kind);
    assert.equal(kinds.filter((kind) => kind === draco.COLOR).length, 1);
    assert.equal(kinds.filter((kind) => kind === draco.NORMAL).length, expectedKinds.normals);
    for (let i = 0; i < found.count; ++i) {
        const position = [0, 1, 2].map((axis) => {
            const local = positions.values.readFloatLE(12 * i + 4 * axis);
            return (Math.round(local / lattice.step) + entry.origin[axis]) * lattice.step + lattice.origin[axis];
        });
        const source = cloud.points.get(position.join());
        assert.ok(source, `a point of the source at ${position}`);
        const seen = new Set();
        for (const attribute of others) {
            const bytes = attribute.values.subarray(i * attribute.size, (i + 1) * attribute.size);
            const names = attribute.kind === draco.COLOR ? ['red', 'green', 'blue']
                : attribute.kind === draco.NORMAL ? ['nx', 'ny', 'nz'] : [attribute.name];
            const each = bytes.length / names.length;
            names.forEach((name, k) => {
                assert.equal(bytes.subarray(k * each, (k + 1) * each).toString('hex'), source.get(name), name);
                seen.add(name);
            });
            const type = cloud.attributes.find(([name]) => name === names[0])[1];
            assert.equal(attribute.type, kTypes[type][0]);
        }
        assert.equal(seen.size, cloud.attributes.length);
    }
    return found.count;
}

const folder = mkdtempSync(join(tmpdir(), 'knap-draco3d-'));
try {
    const cloud = makeCloud(20000);
    writeFileSync(join(folder, 'in.ply'), cloud.bytes);
    for (const encoding of ['auto', 'kd', 'sequential']) {
        const archive = join(folder, encoding);
        execFileSync(knap, ['simplify', join(folder, 'in.ply'), '-o', archive, '--alpha', '0.03', '--step',
            String(2 ** -10), '--tile-points', '1000', '--encoding', encoding, '--quiet']);
        const manifest = JSON.parse(readFileSync(join(archive, 'manifest.json'), 'utf8'));
        assert.deepEqual(manifest.attributes.map(({name}) => name), cloud.attributes.map(([name]) => name));
        let points = 0;
        for (const entry of manifest.tiles) {
            points += checkTile(readFileSync(join(archive, entry.file)), entry, manifest.lattice, cloud,
                {normals: encoding === 'kd' ? 0 : 1});
        }
        assert.equal(points, manifest.counts.kept);
        assert.ok(manifest.tiles.length > 1 && points > 1000);
        console.log(`${encoding}: ${points} points in ${manifest.tiles.length} tiles are those of the source`);
    }
} finally {
    rmSync(folder, {recursive: true});
}
