// Which tiles of an archive are shown when not all of its points can be.

/// The tiles to show, the most important first: those in sight before those that are not, near ones before far ones.
///
/// @param tiles     with `points` and `box` {min, max}
/// @param eye       3 coordinates, in the archive's frame
/// @param inSight   whether a box is seen
/// @param budget    most points together; one tile is shown, however large
export function chooseTiles(tiles, eye, inSight, budget) {
    const ranked = tiles.map((tile, index) => ({
        tile, index, seen: inSight(tile.box), distance: squaredDistance(tile.box, eye),
    }));
    ranked.sort((a, b) => b.seen - a.seen || a.distance - b.distance || a.index - b.index);
    const chosen = [];
    let points = 0;
    for (const {tile} of ranked) {
        if (chosen.length > 0 && points + tile.points > budget) break;
        chosen.push(tile);
        points += tile.points;
    }
    return chosen;
}

/// From a place to the nearest place of a box.
export function squaredDistance(box, place) {
    let sum = 0;
    for (let axis = 0; axis < 3; ++axis) {
        const outside = Math.max(box.min[axis] - place[axis], 0, place[axis] - box.max[axis]);
        sum += outside * outside;
    }
    return sum;
}
