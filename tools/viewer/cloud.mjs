// The tiles of an archive that are loaded, as objects of a scene.

import {BufferAttribute, BufferGeometry, Group, Points} from 'three';
import {fieldsFor, paint} from './colour_modes.mjs';

const kAtOnce = 6;  // tiles being fetched or decoded

export class Cloud {
    /// @param origin    the scene's own, in the archive's frame: 3 doubles
    /// @param material  of all points
    constructor(archive, reader, origin, material) {
        this.archive = archive;
        this.group = new Group();
        this.failures = [];
        this.reader = reader;
        this.origin = origin;
        this.material = material;
        this.loaded = new Map();  // by tile
        this.round = 0;  // of show(); an older one stops
    }

    get shownPoints() {
        return this.tiles().reduce((sum, {count}) => sum + count, 0);
    }

    tiles() {
        return [...this.loaded.values()];
    }

    /// Loads the tiles that are not there yet, with what the mode needs, and drops all others.
    /// @param advance  told after each tile
    /// @return         false if another call took over
    async show(tiles, mode, look, advance) {
        const round = ++this.round;
        const wanted = new Set(tiles);
        for (const [tile, entry] of this.loaded) {
            if (!wanted.has(tile)) this.#drop(tile, entry);
        }
        this.failures = [];
        const fields = fieldsFor(mode, this.archive) ?? [];
        const names = fields.map(({name}) => name).join();
        const queue = tiles.filter((tile) => this.loaded.get(tile)?.names !== names);
        const work = async () => {
            for (let tile = queue.shift(); tile && round === this.round; tile = queue.shift()) {
                await this.#load(tile, fields, names, mode, look, round);
                if (round === this.round) advance();
            }
        };
        await Promise.all(Array.from({length: kAtOnce}, work));
        return round === this.round;
    }

    async #load(tile, fields, names, mode, look, round) {
        const before = this.loaded.get(tile);
        if (before && fields.length === 0) {
            before.fields = new Map();
            before.names = names;
            return;
        }
        let read;
        try {
            read = await this.reader.read(tile, this.archive.attributes, fields);
        } catch (error) {
            this.failures.push(error.message);
            return;
        }
        if (round !== this.round) return;
        const entry = before ?? this.#add(tile, read.positions);
        entry.names = names;
        entry.fields = new Map(fields.map((field) => [field.name, {...field, values: read.values.get(field.name)}]));
        this.#paint(entry, mode, look);
    }

    #add(tile, positions) {
        const count = tile.points;
        const geometry = new BufferGeometry();
        geometry.setAttribute('position', new BufferAttribute(positions, 3));
        geometry.setAttribute('tint', new BufferAttribute(new Uint8Array(4 * count), 4, true));
        geometry.computeBoundingSphere();
        const points = new Points(geometry, this.material);
        // In doubles, so that far coordinates do not shake: the card sees what is left beside the camera.
        points.position.fromArray(tile.corner.map((value, axis) => value - this.origin[axis]));
        this.group.add(points);
        const entry = {points, positions, count, corner: tile.corner, fields: new Map(), names: ''};
        this.loaded.set(tile, entry);
        return entry;
    }

    #drop(tile, entry) {
        this.group.remove(entry.points);
        entry.points.geometry.dispose();
        this.loaded.delete(tile);
    }

    /// Paints all tiles anew.
    paint(mode, look) {
        for (const entry of this.loaded.values()) this.#paint(entry, mode, look);
    }

    #paint(entry, mode, look) {
        const tint = entry.points.geometry.getAttribute('tint');
        paint(tint.array, mode, entry, look.limits, look.upAxis);
        tint.needsUpdate = true;
    }
}
