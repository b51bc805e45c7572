// What the tests of pages share: archives made by knap, a server, a browser that reaches nothing else.
//
//   node tests/viewer/NAME_test.mjs KNAP MODULES DATA PICTURES
//
// MODULES/node_modules has what package.json here names; DATA is the folder of scans, PICTURES takes screenshots.

import assert from 'node:assert/strict';
import {execFileSync, spawn} from 'node:child_process';
import {existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {readPng} from './png.mjs';

export const [knap, modules, data, pictures] = process.argv.slice(2);
export const folder = mkdtempSync(join(tmpdir(), 'knap-viewer-'));
process.on('exit', () => rmSync(folder, {recursive: true, force: true}));

// A colour that no point has, so that the ground can be told from them.
const kGround = [255, 0, 255];
// Software rendering: the same on every machine.
const kFlags = ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
const kBrowsers = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];
const kPatience = 60000;  // milliseconds

/// Ends the test without a verdict; where everything has to be there, it fails.
function leaveOut(reason) {
    if (process.env.CI) throw new Error(`expected all that the tests need, found ${reason}`);
    console.log(`skipped=${reason}`);
    process.exit(0);
}

export async function launch() {
    const executablePath = kBrowsers.find((path) => existsSync(path));
    if (!executablePath) leaveOut('no Chromium; tools/setup --checks installs it');
    let playwright;
    try {
        playwright = createRequire(join(modules, 'package.json'))('playwright-core');
    } catch {
        leaveOut(`no playwright-core in ${modules}`);
    }
    mkdirSync(pictures, {recursive: true});
    return playwright.chromium.launch({executablePath, args: kFlags});
}

/// A scan of the test data; null, with a word, where there is none.
export function scan(name) {
    const path = join(data, name);
    if (existsSync(path)) return path;
    console.log(`# left out: no ${path}`);
    return null;
}

/// Makes an archive of a file.
/// @return {path, manifest}
export function makeArchive(name, input, ...flags) {
    const path = join(folder, name);
    execFileSync(knap, ['simplify', input, '-o', path, '--quiet', ...flags], {stdio: ['ignore', 'ignore', 'inherit']});
    return {path, manifest: JSON.parse(readFileSync(join(path, 'manifest.json'), 'utf8'))};
}

/// Runs a server that prints its address first.
/// @return {address, stop}: stop() ends it as Ctrl-C does and gives its exit status
export async function serve(program, ...args) {
    const server = spawn(program, args, {stdio: ['ignore', 'pipe', 'ignore']});
    const ended = new Promise((resolve) => server.on('exit', (status, signal) => resolve(status ?? signal)));
    const address = await Promise.race([new Promise((resolve) => server.stdout.once('data', (text) => resolve(String(text).trim()))),
        ended.then((status) => { throw new Error(`${program} ${args.join(' ')}: ended with ${status}`); })]);
    return {address, stop: () => {
        server.kill('SIGINT');
        return ended;
    }};
}

/// A page of the viewer, on archives.
export class ViewerPage {
    /// @param query  in place of what knap view prints
    static async open(browser, args, {query, errors = []} = {}) {
        const viewer = new ViewerPage();
        viewer.server = await serve(knap, 'view', ...args);
        viewer.allowed = errors;
        viewer.wrong = [];
        viewer.responses = new Map();
        viewer.context = await browser.newContext({viewport: {width: 820, height: 540}});
        const page = viewer.page = await viewer.context.newPage();
        watch(page, viewer);
        const address = new URL(viewer.server.address);
        await page.goto(query === undefined ? address.href : new URL(query, address).href);
        await viewer.settled();
        return viewer;
    }

    /// Waits until nothing is under way, and everything is drawn.
    async settled() {
        await this.page.waitForSelector('#status[data-state="ready"], #status[data-state="failed"]',
            {state: 'attached', timeout: kPatience});
        await this.page.evaluate(() => new Promise((resolve) => {
            requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(resolve)));
        }));
    }

    status() {
        return this.page.evaluate(() => ({...document.getElementById('status').dataset,
            text: document.getElementById('status').textContent,
            errors: document.getElementById('errors').textContent}));
    }

    camera(pane = 0) {
        return this.page.locator('canvas').nth(pane).getAttribute('data-camera')
            .then((text) => text.split(' ').map(Number));
    }

    /// Sets a control as a user does.
    async set(id, value) {
        const control = this.page.locator(`#${id}`);
        if (typeof value === 'boolean') {
            await control.setChecked(value);
        } else if (await control.evaluate((element) => element.tagName) === 'SELECT') {
            await control.selectOption(value);
        } else {
            await control.fill(value);
        }
        await this.settled();
    }

    /// The picture of a pane without its caption, on kGround.
    async picture(pane = 0) {
        await this.page.evaluate((ground) => {
            for (const stage of document.querySelectorAll('.stage')) stage.style.background = ground;
            for (const caption of document.querySelectorAll('figcaption')) caption.style.display = 'none';
        }, `rgb(${kGround.join(' ')})`);
        await this.settled();
        return new Picture(readPng(await this.page.locator('canvas').nth(pane).screenshot()));
    }

    async save(name) {
        await this.page.screenshot({path: join(pictures, `${name}.png`)});
    }

    /// @throws if a request left this machine, the page said something on its console, or the server did not end well
    async close() {
        await this.context.close();
        assert.equal(await this.server.stop(), 0);
        assert.deepEqual(this.wrong, []);
    }
}

/// Notes in `log` what a page must not do (wrong) and what it was answered (responses).
export function watch(page, log) {
    const note = (text) => {
        if (!log.allowed?.some((allowed) => allowed.test(text))) log.wrong.push(text);
    };
    page.route(/^(?!(http:\/\/127\.0\.0\.1:\d+\/|data:|blob:))/, (route) => {
        note(`request of ${route.request().url()}`);
        return route.abort();
    });
    page.on('console', (message) => ['error', 'warning'].includes(message.type())
        && note(`${message.type()}: ${message.text()} ${message.location().url}`));
    page.on('pageerror', (error) => note(error.message));
    page.on('response', (response) => log.responses.set(new URL(response.url()).pathname, response.status()));
}

/// A picture on a ground of one colour.
export class Picture {
    constructor({width, height, at}, ground = kGround) {
        Object.assign(this, {width, height, at});
        this.lit = [];  // {x, y, colour} of the points
        for (let y = 0; y < height; ++y) {
            for (let x = 0; x < width; ++x) {
                const colour = at(x, y);
                if (colour.some((value, k) => value !== ground[k])) this.lit.push({x, y, colour});
            }
        }
    }

    /// The share that points cover.
    get coverage() {
        return this.lit.length / (this.width * this.height);
    }

    /// The share of pixels that another picture of the same size has otherwise.
    difference(other) {
        assert.deepEqual([this.width, this.height], [other.width, other.height]);
        let count = 0;
        for (let y = 0; y < this.height; ++y) {
            for (let x = 0; x < this.width; ++x) count += String(this.at(x, y)) !== String(other.at(x, y));
        }
        return count / (this.width * this.height);
    }
}
