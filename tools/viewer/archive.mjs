// A knap archive as docs/formats.md describes it: its manifest, its tiles, what its points carry.

const kFormatVersion = 1;

/// @param url  of the archive's folder, absolute or relative to the page
/// @throws Error that says what was expected, if there is no archive
export async function openArchive(url) {
    const folder = new URL(url.endsWith('/') ? url : `${url}/`, document.baseURI);
    const response = await fetch(new URL('manifest.json', folder));
    if (!response.ok) throw new Error(`${folder.pathname}manifest.json: ${response.status} ${response.statusText}`);
    const manifest = await response.json();
    if (manifest.format !== 'knap archive') throw new Error(`${folder.pathname}: expected a knap archive`);
    if (manifest.format_version > kFormatVersion) {
        throw new Error(`${folder.pathname}: expected format ${kFormatVersion}, found ${manifest.format_version}`);
    }
    const attributes = manifest.attributes ?? [];
    return {
        manifest,
        attributes,
        fields: fieldsOf(attributes),
        points: manifest.counts.kept,
        tiles: manifest.tiles.map((tile) => ({
            ...tile,
            url: new URL(tile.file, folder),
            // Doubles: what a graphics card gets is relative to this.
            corner: tile.origin.map((index, axis) => index * manifest.lattice.step + manifest.lattice.origin[axis]),
        })),
    };
}

/// What a point can be coloured by: every component of every attribute.
function fieldsOf(attributes) {
    return attributes.flatMap((attribute) => Array.from({length: attribute.components}, (_, component) => ({
        name: attribute.components === 1 ? attribute.name : `${attribute.name}[${component}]`,
        attribute: attribute.name,
        component,
        scale: attribute.scale ?? 1,
        offset: attribute.offset ?? 0,
        description: attribute.description ?? '',
    })));
}

/// The attributes of a tile's Draco file behind the positions, each with its id in the file.
/// @param kdTree  whether the tile is coded as a kd-tree, which has no normals of their own
export function storedAttributes(attributes, kdTree) {
    const stored = [];
    const colour = findTriple(attributes, ['red', 'green', 'blue'], ['uint8', 'uint16']);
    const normal = kdTree ? null : findTriple(attributes, ['nx', 'ny', 'nz'], ['float32']);
    for (const triple of [colour, normal]) {
        if (triple) stored.push({names: triple.map(({name}) => name), type: triple[0].type, components: 3});
    }
    const taken = new Set(stored.flatMap(({names}) => names));
    for (const {name, type, components} of attributes) {
        if (!taken.has(name)) stored.push({names: [name], type, components});
    }
    return stored.map((entry, index) => ({...entry, id: index + 1}));
}

function findTriple(attributes, names, types) {
    const members = names.map((name) => attributes.find((attribute) => attribute.name === name));
    const alike = members.every((member) => member && member.components === 1 && member.type === members[0].type
        && (member.scale ?? 1) === 1 && (member.offset ?? 0) === 0 && !member.description);
    return alike && types.includes(members[0].type) ? members : null;
}
