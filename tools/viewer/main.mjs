// The page: opens the archives that its address names, and puts panel and panes together.
//
//     ?archive=FOLDER  address of the archive, beside the page; archive/ if not given
//     ?before=FOLDER   of another, shown beside it

import {openArchive} from './archive.mjs';
import {chooseTiles} from './choose_tiles.mjs';
import {Cloud} from './cloud.mjs';
import {colourModes, limitsOf} from './colour_modes.mjs';
import {kDirections, Pane} from './pane.mjs';
import {fail, formatCount, Panel, setHeading, setStatus} from './panel.mjs';
import {makePointMaterial} from './point_material.mjs';
import {TileReader} from './tile_reader.mjs';

const kTurn = Math.PI / 24;
const kStill = 250;  // milliseconds without a move, after which other tiles are chosen

class Viewer {
    constructor(archives) {
        this.archives = archives;
        const {min, max} = archives.at(-1).manifest.box;
        this.origin = min.map((value, axis) => (Number.isFinite(value) ? (value + max[axis]) / 2 : 0));
        const extent = min.map((value, axis) => (Number.isFinite(value) ? max[axis] - value : 0));
        this.radius = Math.hypot(...extent) / 2 || 1;
        this.material = makePointMaterial();
        const reader = new TileReader();
        this.panes = archives.map((archive) => this.#addPane(archive, reader));
        this.look = {limits: {low: 0, high: 1, logarithmic: false, white: 255}, upAxis: 2};
        this.panel = new Panel(colourModes(archives), archives.length > 1, {
            colour: () => this.load(),
            size: () => this.#setSize(),
            shade: (on) => this.#each((pane) => Object.assign(pane, {shaded: on}).invalidate()),
            look: (name) => this.#moveAll((pane) => pane.look(name)),
            up: (axis) => this.#setUp(axis),
            show: (which) => this.#show(which),
            budget: () => this.load(),
        });
        this.#setSize();
        this.#moveAll((pane) => pane.look('fit'));
    }

    #addPane(archive, reader) {
        const figure = document.getElementById('pane').content.firstElementChild.cloneNode(true);
        document.getElementById('panes').append(figure);
        const canvas = figure.querySelector('canvas');
        const cloud = new Cloud(archive, reader, this.origin, this.material);
        const pane = new Pane(canvas, cloud, this.radius, (moved) => this.#follow(moved));
        pane.figure = figure;
        pane.title = this.archives.length === 1 ? '' : archive === this.archives[0] ? 'Before: ' : 'After: ';
        canvas.setAttribute('aria-label', `${pane.title}point cloud of ${formatCount(archive.points)} points`);
        canvas.addEventListener('keydown', (event) => this.#onKey(pane, event));
        return pane;
    }

    #each(act) {
        this.panes.forEach(act);
    }

    #shownPanes() {
        return this.panes.filter(({figure}) => !figure.hidden);
    }

    #moveAll(move) {
        this.following = true;
        this.#each(move);
        this.following = false;
        this.#chooseSoon();
    }

    #follow(moved) {
        if (!this.panel || this.following) return;
        if (this.panel.linked()) this.#each((pane) => pane !== moved && pane.follow(moved));
        this.#chooseSoon();
    }

    #setSize() {
        this.material.uniforms.size.value = this.panel.size() * Math.min(devicePixelRatio, 2);
        this.#each((pane) => pane.invalidate());
    }

    #setUp(axis) {
        this.look.upAxis = axis;
        this.#each((pane) => pane.setUp(axis));
        this.#moveAll((pane) => pane.look('fit'));
        this.#repaint();
    }

    #show(which) {
        this.#each((pane, index) => {
            pane.figure.hidden = which === 'before' ? index > 0 : which === 'after' ? index === 0 : false;
        });
    }

    #onKey(pane, event) {
        if (event.ctrlKey || event.altKey || event.metaKey) return;
        const turns = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
        const looks = {f: 'fit', 1: 'top', 2: 'front', 3: 'side'};
        const nearer = {'+': 1 / 1.15, '=': 1 / 1.15, '-': 1.15};
        if (turns[event.key]) {
            pane.turn(...turns[event.key].map((steps) => steps * kTurn), 1);
        } else if (nearer[event.key]) {
            pane.turn(0, 0, nearer[event.key]);
        } else if (looks[event.key.toLowerCase()] in kDirections) {
            this.#moveAll((each) => each.look(looks[event.key.toLowerCase()]));
        } else {
            return;
        }
        event.preventDefault();
    }

    /// Other tiles may be nearer now.
    #chooseSoon() {
        if (this.archives.every(({points}) => points <= this.panel.budget())) return;
        clearTimeout(this.waiting);
        this.waiting = setTimeout(() => this.load(), kStill);
    }

    /// Loads the tiles that the budget has room for, with what the colours need, and paints them.
    async load() {
        const mode = this.panel.mode();
        const chosen = this.panes.map((pane) => {
            const {eye, inSight} = pane.sight();
            return chooseTiles(pane.cloud.archive.tiles, eye, inSight, this.panel.budget());
        });
        let done = 0;
        this.#tell(done);
        this.look.limits = this.#limits(mode);
        const finished = await Promise.all(this.panes.map(({cloud}, index) => cloud.show(chosen[index], mode, this.look, () => {
            this.#tell(++done);
            this.#each((pane) => pane.invalidate());
        })));
        if (!finished.every(Boolean)) return;
        this.#repaint();
        this.#tell(null);
    }

    #limits(mode) {
        return limitsOf(mode, this.panes.flatMap(({cloud}) => cloud.tiles()), this.look.upAxis);
    }

    #repaint() {
        const mode = this.panel.mode();
        this.look.limits = this.#limits(mode);
        this.panel.setLimits(this.look.limits, mode);
        this.#each((pane) => {
            pane.cloud.paint(mode, this.look);
            pane.invalidate();
        });
    }

    #tell(progress) {
        const sum = (number) => this.panes.reduce((all, {cloud}) => all + number(cloud), 0);
        this.#each(({figure, title, cloud}) => {
            figure.dataset.shown = cloud.shownPoints;
            figure.querySelector('figcaption').textContent = `${title}${formatCount(cloud.shownPoints)} points`;
        });
        setStatus({
            shown: sum((cloud) => cloud.shownPoints),
            total: sum((cloud) => cloud.archive.points),
            tiles: sum((cloud) => cloud.loaded.size),
            allTiles: sum((cloud) => cloud.archive.tiles.length),
            progress,
            failures: this.panes.flatMap(({cloud}) => cloud.failures),
        });
    }
}

async function start() {
    const address = new URLSearchParams(location.search);
    const archive = await openArchive(address.get('archive') ?? 'archive/');
    const before = address.has('before') ? await openArchive(address.get('before')) : null;
    setHeading(archive, before);
    await new Viewer(before ? [before, archive] : [archive]).load();
}

start().catch(fail);
