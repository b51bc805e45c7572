// Reads tiles by three.js's DRACOLoader, which decodes in workers.

import {DRACOLoader} from 'three/addons/loaders/DRACOLoader.js';
import {storedAttributes} from './archive.mjs';
import {arrayTypeOf, componentOf} from './stored_values.mjs';

const kPositions = 0;  // id of the positions in every tile
const kMethodByte = 8;  // of Draco's header
const kKdTree = 1;

export class TileReader {
    #loader = new DRACOLoader();

    constructor() {
        this.#loader.setWorkerLimit(Math.max(1, Math.min(4, navigator.hardwareConcurrency ?? 2)));
        this.#loader.preload();
    }

    /// @param attributes  of the archive
    /// @param fields      those to read
    /// @return            {positions, values}: local coordinates, 3 floats a point; for each field's name a number a
    ///                    point, as it is stored
    /// @throws Error naming the tile
    async read(tile, attributes, fields) {
        try {
            const response = await fetch(tile.url);
            if (!response.ok) throw new Error(`${response.status} ${response.statusText}`);
            return await this.#decode(await response.arrayBuffer(), tile, attributes, fields);
        } catch (error) {
            throw new Error(`${tile.file}: ${error.message ?? error.error ?? error}`);
        }
    }

    async #decode(bytes, tile, attributes, fields) {
        const kdTree = new Uint8Array(bytes)[kMethodByte] === kKdTree;
        const stored = storedAttributes(attributes, kdTree);
        const wanted = new Set(fields.map((field) => storedWith(stored, field)));
        const attributeIDs = {position: kPositions};
        const attributeTypes = {position: 'Float32Array'};
        for (const entry of wanted) {
            attributeIDs[`stored${entry.id}`] = entry.id;
            attributeTypes[`stored${entry.id}`] = arrayTypeOf(entry.type);
        }
        const geometry = await this.#loader.decodeGeometry(bytes, {attributeIDs, attributeTypes, useUniqueIDs: true});
        const {array: positions, count} = geometry.getAttribute('position');
        if (count !== tile.points) throw new Error(`expected ${tile.points} points, found ${count}`);
        const values = new Map();
        for (const field of fields) {
            const entry = storedWith(stored, field);
            const found = geometry.getAttribute(`stored${entry.id}`);
            const component = entry.names.length > 1 ? entry.names.indexOf(field.attribute) : field.component;
            values.set(field.name, componentOf({
                array: found.data?.array ?? found.array,
                itemSize: found.itemSize,
                stride: found.data?.stride ?? found.itemSize,
                count,
            }, entry, component));
        }
        return {positions, values};
    }
}

function storedWith(stored, field) {
    return stored.find(({names}) => names.includes(field.attribute));
}
