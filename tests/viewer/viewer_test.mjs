// Looks at archives by knap view in Chromium.

import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, test} from 'node:test';
import {folder, knap, launch, makeArchive, scan, ViewerPage} from './support.mjs';

const browser = await launch();
after(() => browser.close());

const terrain = makeTerrain();
const dragon = scan('scans/dragon_vrip.ply.gz');

/// Hills in colour, with what LAS files carry: where the data is, a crop of autzen; else made here.
function makeTerrain() {
    const autzen = scan('lidar/autzen_trim.las');
    if (autzen) return makeArchive('terrain', autzen, '--ratio', '0.3', '--tile-points', '8000');
    return makeArchive('terrain', hills('terrain.xyz', [0, 0, 0]), '--ratio', '0.9', '--tile-points', '2000');
}

/// Hills as text, each point in a colour of its own, on steps of 1/64.
function hills(name, corner) {
    const lines = ['x y z red green blue intensity classification'];
    for (let i = 0; i < 120; ++i) {
        for (let j = 0; j < 80; ++j) {
            const z = Math.round(64 * 6 * Math.sin(i / 9) * Math.cos(j / 11)) / 64;
            lines.push([corner[0] + 75 * i / 64, corner[1] + 75 * j / 64, corner[2] + z, 2 * i, 3 * j, 90, i + j, (i >> 4) % 5].join(' '));
        }
    }
    const path = join(folder, name);
    writeFileSync(path, `${lines.join('\n')}\n`);
    return path;
}

async function withViewer(args, act, options) {
    const viewer = await ViewerPage.open(browser, args, options);
    try {
        await act(viewer);
    } finally {
        await viewer.close();
    }
}

const looksAlong = async (viewer, pane) => {
    const camera = await viewer.camera(pane);
    const offset = [0, 1, 2].map((axis) => camera[axis] - camera[axis + 3]);
    return offset.map((value) => value / Math.hypot(...offset));
};

test('every tile is loaded, all points are shown, the picture is not blank', () => withViewer([terrain.path], async (viewer) => {
    const {counts, tiles} = terrain.manifest;
    assert.ok(tiles.length > 2);
    for (const {file} of tiles) assert.equal(viewer.responses.get(`/archive/${file}`), 200, file);
    const status = await viewer.status();
    assert.equal(status.errors, '');
    assert.equal(Number(status.shown), counts.kept);
    assert.equal(Number(status.tiles), tiles.length);
    assert.match(status.text, new RegExp(`^${counts.kept.toLocaleString('en')} of ${counts.kept.toLocaleString('en')} points`));
    await viewer.save('terrain');
    const picture = await viewer.picture();
    assert.ok(picture.coverage > 0.05, `covered ${picture.coverage}`);
    assert.ok(new Set(picture.lit.map(({colour}) => String(colour))).size > 100);
}));

test('RGB shows the very colours of the points', () => withViewer([terrain.path], async (viewer) => {
    const text = join(folder, 'colours.xyz');
    execFileSync(knap, ['decode', terrain.path, '-o', text], {stdio: 'ignore'});
    const [names, ...lines] = readFileSync(text, 'utf8').trim().split('\n').map((line) => line.split(' '));
    const at = ['red', 'green', 'blue'].map((name) => names.indexOf(name));
    const deep = lines.some((line) => at.some((k) => Number(line[k]) > 255));
    const colours = new Set(lines.map((line) => String(at.map((k) => Math.floor(line[k] / (deep ? 257 : 1))))));
    await viewer.set('colour', 'rgb');
    await viewer.set('shade', false);
    const {lit} = await viewer.picture();
    const strange = lit.filter(({colour}) => !colours.has(String(colour)));
    assert.ok(lit.length > 5000 && strange.length === 0, `${strange.length} of ${lit.length}`);
}));

test('every other way to colour makes another picture; height is dark below and light above', () => withViewer([terrain.path], async (viewer) => {
    await viewer.set('shade', false);
    await viewer.page.locator('[data-look="front"]').click();
    const modes = await viewer.page.locator('#colour option:enabled').evaluateAll((all) => all.map(({value}) => value));
    for (const mode of ['rgb', 'height', 'plain', 'field:intensity', 'field:classification']) assert.ok(modes.includes(mode), mode);
    const seen = [];
    for (const mode of ['rgb', 'height', 'plain', 'field:intensity', 'field:classification']) {
        await viewer.set('colour', mode);
        const picture = await viewer.picture();
        for (const [other, before] of seen) assert.ok(picture.difference(before) > 0.01, `${mode} and ${other}`);
        seen.push([mode, picture]);
        assert.equal(await viewer.page.locator('#legend').isVisible(), ['height', 'field:intensity'].includes(mode));
    }
    const {lit} = new Map(seen).get('height');
    const rows = lit.map(({y}) => y).sort((a, b) => a - b);
    const light = (test) => {
        const greens = lit.filter(({y}) => test(y)).map(({colour}) => colour[1]);
        return greens.reduce((sum, green) => sum + green, 0) / greens.length;
    };
    const [low, high] = [0.9, 0.1].map((share) => rows[Math.floor(share * rows.length)]);
    assert.ok(light((y) => y < high) > light((y) => y > low) + 40);
}));

test('larger points cover more; shading darkens', () => withViewer([terrain.path], async (viewer) => {
    await viewer.set('shade', false);
    let covered = 0;
    for (const size of ['1', '2', '4', '8']) {
        await viewer.set('size', size);
        const {coverage} = await viewer.picture();
        assert.ok(coverage > 1.1 * covered, `${size}: ${coverage} after ${covered}`);
        covered = coverage;
    }
    const light = ({lit}) => lit.reduce((sum, {colour}) => sum + colour[1], 0) / lit.length;
    const flat = light(await viewer.picture());
    await viewer.set('shade', true);
    assert.ok(light(await viewer.picture()) < flat - 1);
}));

test('buttons and keys move the camera, and fit brings it back', () => withViewer([terrain.path], async (viewer) => {
    const {page} = viewer;
    const start = await viewer.camera();
    const expected = {top: [0, 0, 1], front: [0, -1, 0], side: [1, 0, 0]};
    for (const [name, direction] of Object.entries(expected)) {
        const before = await viewer.picture();
        await page.locator(`[data-look="${name}"]`).click();
        await viewer.settled();
        (await looksAlong(viewer)).forEach((value, axis) => assert.ok(Math.abs(value - direction[axis]) < 1e-3, name));
        assert.ok((await viewer.picture()).difference(before) > 0.01);
    }
    await page.locator('canvas').focus();
    const keys = [['1', 'top'], ['2', 'front'], ['3', 'side']];
    for (const [key, name] of keys) {
        await page.keyboard.press(key);
        await viewer.settled();
        (await looksAlong(viewer)).forEach((value, axis) => assert.ok(Math.abs(value - expected[name][axis]) < 1e-3, key));
    }
    for (const key of ['ArrowLeft', 'ArrowUp', '+', '-']) {
        const before = await viewer.camera();
        await page.keyboard.press(key);
        await viewer.settled();
        assert.notDeepEqual(await viewer.camera(), before, key);
    }
    await page.locator('[data-look="fit"]').click();
    await viewer.settled();
    assert.deepEqual(await viewer.camera(), start);
}));

test('before and after: two canvases whose cameras move together until they are told not to', {skip: !dragon}, async () => {
    const kept = makeArchive('dragon', dragon, '--ratio', '0.2', '--tile-points', '20000');
    const all = makeArchive('dragon_all', dragon, '--alpha', '1e-9');
    await withViewer([kept.path, '--before', all.path], async (viewer) => {
        const {page} = viewer;
        assert.equal(await page.locator('canvas').count(), 2);
        const shown = await page.locator('figure').evaluateAll((all) => all.map(({dataset}) => Number(dataset.shown)));
        assert.deepEqual(shown, [all.manifest.counts.kept, kept.manifest.counts.kept]);
        await viewer.set('up', '1');
        await viewer.save('dragon');
        const drag = async (pane) => {
            const box = await page.locator('canvas').nth(pane).boundingBox();
            await page.mouse.move(box.x + 200, box.y + 200);
            await page.mouse.down();
            await page.mouse.move(box.x + 120, box.y + 230, {steps: 3});
            await page.mouse.up();
            await viewer.settled();
        };
        for (const pane of [0, 1]) {
            const before = await viewer.camera(0);
            await drag(pane);
            assert.deepEqual(await viewer.camera(1), await viewer.camera(0));
            assert.notDeepEqual(await viewer.camera(0), before);
        }
        await viewer.set('link', false);
        const before = await viewer.camera(0);
        await drag(1);
        assert.deepEqual(await viewer.camera(0), before);
        assert.notDeepEqual(await viewer.camera(1), before);
        for (const [which, expected] of [['before', [true, false]], ['after', [false, true]], ['both', [true, true]]]) {
            await page.locator(`[name="show"][value="${which}"]`).check();
            const visible = [0, 1].map((pane) => page.locator('canvas').nth(pane).isVisible());
            assert.deepEqual(await Promise.all(visible), expected);
        }
    });
});

test('curvature and range are shown where an archive carries them', async () => {
    const flake = join(folder, 'flake.ply');
    execFileSync(knap, ['synth', 'flake', '--points', '60000', '-o', flake], {stdio: 'ignore'});
    const kept = makeArchive('flake', flake, '--ratio', '0.2', '--measures');
    const all = makeArchive('flake_all', flake, '--alpha', '1e-9', '--measures');
    await withViewer([kept.path, '--before', all.path], async (viewer) => {
        assert.equal(await viewer.page.locator('#absent').isVisible(), false);
        await viewer.set('colour', 'curvature');
        await viewer.save('flake');
        await viewer.set('colour', 'range');
        const byRange = await viewer.picture(1);
        await viewer.set('colour', 'curvature');
        assert.match(await viewer.page.locator('#low').textContent(), /log/);
        assert.ok((await viewer.picture(1)).difference(byRange) > 0.02);
    });
    await withViewer([terrain.path], async (viewer) => {
        assert.ok(await viewer.page.locator('#absent').isVisible());
        assert.ok(await viewer.page.locator('#colour option[value="curvature"]').isDisabled());
    });
});

test('coordinates far from the origin make the same picture, to the pixel', async () => {
    const pictures = [];
    for (const [name, corner] of [['near', [0, 0, 0]], ['far', [4500000, 5600000, 2300]]]) {
        const archive = makeArchive(name, hills(`${name}.xyz`, corner), '--alpha', '1e-9', '--step', String(1 / 64),
            '--tile-points', '2000');
        await withViewer([archive.path], async (viewer) => {
            await viewer.set('colour', 'rgb');
            const {page} = viewer;
            await page.locator('canvas').focus();
            for (let k = 0; k < 12; ++k) await page.keyboard.press('+');
            pictures.push(await viewer.picture());
        });
    }
    assert.ok(pictures[0].coverage > 0.02);
    assert.equal(pictures[0].difference(pictures[1]), 0);
});

test('where not all points are shown, it says how many are, and near ones come first', () => withViewer([terrain.path], async (viewer) => {
    const {page} = viewer;
    const {counts} = terrain.manifest;
    const budget = Math.floor(counts.kept / 3);
    await page.locator('#budget option').first().evaluate((option, value) => { option.value = value; }, String(budget));
    await viewer.set('budget', String(budget));
    const status = await viewer.status();
    assert.ok(Number(status.shown) <= budget && Number(status.shown) > 0);
    assert.match(status.text, new RegExp(`^${Number(status.shown).toLocaleString('en')} of ${counts.kept.toLocaleString('en')} points shown`));
    assert.match(status.text, /nearest/);
}));

test('a damaged tile is told by name, and the others are shown', async () => {
    const archive = makeArchive('damaged', hills('damaged.xyz', [0, 0, 0]), '--alpha', '1e-9', '--tile-points', '2000');
    const [bad] = archive.manifest.tiles;
    const bytes = readFileSync(join(archive.path, bad.file));
    writeFileSync(join(archive.path, bad.file), bytes.subarray(0, bytes.length / 2));
    await withViewer([archive.path], async (viewer) => {
        const status = await viewer.status();
        assert.match(status.errors, new RegExp(`^${bad.file}: `));
        assert.equal(Number(status.shown), archive.manifest.counts.kept - bad.points);
        assert.equal(Number(status.tiles), archive.manifest.tiles.length - 1);
    }, {errors: [/Decoding failed/]});
});

test('where there is no archive the page says so', () => withViewer([terrain.path], async (viewer) => {
    const status = await viewer.status();
    assert.equal(status.state, 'failed');
    assert.match(status.errors, /^\/none\/manifest.json: 404/);
}, {query: '/?archive=none/', errors: [/404 \(Not Found\)/]}));
