// Loads the 3D Tiles of archives with other people's viewers: CesiumJS and NASA's 3d-tiles-renderer.

import assert from 'node:assert/strict';
import {createReadStream, existsSync, statSync} from 'node:fs';
import {createServer} from 'node:http';
import {dirname, extname, join, normalize} from 'node:path';
import {after, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {launch, makeArchive, modules, Picture, pictures, scan, watch} from './support.mjs';
import {readPng} from './png.mjs';

const kTypes = {'.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.json': 'application/json',
    '.css': 'text/css', '.wasm': 'application/wasm'};
const kPatience = 60000;  // milliseconds
const kGround = [0x1e, 0x22, 0x28];
const here = dirname(fileURLToPath(import.meta.url));
const browser = await launch();
after(() => browser.close());

/// Serves an archive, the npm packages, and the pages beside this file.
function serve(archive) {
    const folders = {archive, npm: join(modules, 'node_modules'), page: here};
    const server = createServer((request, response) => {
        const [, first, ...rest] = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname)).split('/');
        const path = join(folders[first] ?? '/nowhere', ...rest);
        if (!folders[first] || !existsSync(path) || !statSync(path).isFile()) {
            response.writeHead(404).end();
            return;
        }
        response.writeHead(200, {'Content-Type': kTypes[extname(path)] ?? 'application/octet-stream'});
        createReadStream(path).pipe(response);
    });
    return new Promise((resolve) => server.listen(0, '127.0.0.1', () => resolve(server)));
}

/// Opens a page on the 3D Tiles of an archive, and waits until all of them are there and shown.
async function show(pageName, archive, picture) {
    const server = await serve(archive.path);
    const context = await browser.newContext({viewport: {width: 640, height: 480}});
    const page = await context.newPage();
    const log = {wrong: [], responses: new Map(), allowed: [/GPU stall due to ReadPixels/, /will be cast to a float array/]};
    watch(page, log);
    try {
        await page.goto(`http://127.0.0.1:${server.address().port}/page/${pageName}.html`);
        const {kept} = archive.manifest.counts;
        await page.waitForFunction((points) => window.found && (window.found.failures.length > 0
            || (window.found.points >= points && window.found.shown >= points)), kept, {timeout: kPatience})
            .catch((error) => log.wrong.push(error.message));
        const found = await page.evaluate(() => window.found);
        if (log.wrong.length > 0) log.wrong.push(JSON.stringify(found));
        const bytes = await page.screenshot({path: join(pictures, `${picture}.png`)});
        assert.deepEqual(log.wrong, []);
        assert.deepEqual(found.failures, []);
        assert.equal(found.points, kept);
        assert.equal(found.shown, kept);
        const {lit} = new Picture(readPng(bytes), kGround);
        assert.ok(lit.length > 0.02 * 640 * 480, `${lit.length} pixels`);
        return {found, colours: new Set(lit.map(({colour}) => String(colour))).size, responses: log.responses};
    } finally {
        await context.close();
        server.close();
    }
}

const autzen = scan('lidar/autzen_trim.las');
const dragon = scan('scans/dragon_vrip.ply.gz');

for (const [page, name] of [['tileset_three', '3d-tiles-renderer'], ['tileset_cesium', 'CesiumJS']]) {
    test(`${name} loads every point of a scan on the Earth, in colour`, {skip: !autzen}, async () => {
        const archive = makeArchive(`${page}_autzen`, autzen, '--ratio', '0.4', '--tile-points', '8000', '--tileset');
        const {found, colours} = await show(page, archive, `autzen_${page}`);
        assert.ok(found.tiles > 1 && colours > 100);
    });
    test(`${name} loads every point of an object in a frame of its own`, {skip: !dragon}, async () => {
        const archive = makeArchive(`${page}_dragon`, dragon, '--ratio', '0.2', '--tile-points', '20000', '--tileset');
        const {found} = await show(page, archive, `dragon_${page}`);
        assert.ok(found.tiles > 1);
    });
}
