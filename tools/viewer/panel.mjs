// The controls beside the picture, and the words around it.

import {rampGradient} from './colour_map.mjs';

const find = (id) => document.getElementById(id);

export function formatCount(count) {
    return count.toLocaleString('en');
}

function formatNumber(value) {
    const size = Math.abs(value);
    return size !== 0 && (size < 1e-3 || size >= 1e7) ? value.toExponential(3) : String(Number(value.toPrecision(6)));
}

export class Panel {
    /// @param act  {colour(mode), size(px), shade(on), look(name), up(axis), show(which), budget(points)}
    constructor(modes, hasBefore, act) {
        this.modes = modes;
        this.#fillColours();
        const onChange = (id, call) => find(id).addEventListener('change', (event) => call(event.target));
        onChange('colour', () => act.colour(this.mode()));
        onChange('shade', ({checked}) => act.shade(checked));
        onChange('up', ({value}) => act.up(Number(value)));
        onChange('budget', ({value}) => act.budget(Number(value)));
        find('size').addEventListener('input', () => {
            this.#tellSize();
            act.size(this.size());
        });
        for (const button of document.querySelectorAll('[data-look]')) {
            button.addEventListener('click', () => act.look(button.dataset.look));
        }
        for (const radio of document.querySelectorAll('[name="show"]')) {
            radio.addEventListener('change', () => act.show(radio.value));
        }
        find('panel').addEventListener('submit', (event) => event.preventDefault());
        find('beside').hidden = !hasBefore;
        find('ramp').style.background = rampGradient();
        this.#tellSize();
    }

    #fillColours() {
        const option = ({id, label, missing}) => Object.assign(new Option(missing ? `${label}: ${missing}` : label, id),
            {disabled: missing !== ''});
        const attributes = document.createElement('optgroup');
        attributes.label = 'Attributes';
        attributes.append(...this.modes.filter((mode) => mode.attribute).map(option));
        find('colour').append(...this.modes.filter((mode) => !mode.attribute).map(option));
        if (attributes.children.length > 0) find('colour').append(attributes);
        find('colour').value = this.modes.find(({missing}) => missing === '').id;
        const measures = this.modes.filter(({id, missing}) => ['curvature', 'range'].includes(id) && missing);
        find('absent').hidden = measures.length === 0;
        find('absent').textContent = `The archive does not carry ${measures.map(({id}) => id).join(' and ')} of its points: knap simplify --measures does.`;
    }

    #tellSize() {
        find('size-value').textContent = `${find('size').value} px`;
    }

    mode() {
        return this.modes.find(({id}) => id === find('colour').value);
    }

    size() {
        return Number(find('size').value);
    }

    budget() {
        return Number(find('budget').value);
    }

    linked() {
        return find('link').checked;
    }

    upAxis() {
        return Number(find('up').value);
    }

    setLimits({low, high, logarithmic}, mode) {
        find('legend').hidden = !['height', 'number'].includes(mode.kind);
        find('low').textContent = `${formatNumber(low)}${logarithmic ? ' (log)' : ''}`;
        find('high').textContent = formatNumber(high);
    }
}

export function setHeading(archive, before) {
    const {counts, crs, spacing} = archive.manifest;
    const name = archive.manifest.sources.map(({path}) => path.split('/').pop());
    const title = name.length > 1 ? `${name[0]} and ${name.length - 1} more` : name[0] ?? 'archive';
    find('title').textContent = title;
    document.title = `${title}: knap view`;
    const facts = [`${formatCount(counts.kept)} of ${formatCount(counts.in)} points kept`,
        `spacing before ${formatNumber(spacing)}`];
    if (before) facts.push(`beside ${formatCount(before.points)} points`);
    if (crs) facts.push(crs.startsWith('EPSG') ? crs : crs.split('"')[1] ?? crs);
    find('facts').textContent = facts.join(' \u00b7 ');
}

/// @param progress  tiles done, of all; null when nothing is under way
export function setStatus({shown, total, tiles, allTiles, progress, failures}) {
    const status = find('status');
    const bar = find('progress');
    bar.max = Math.max(1, allTiles);
    bar.value = progress ?? allTiles;
    const part = shown < total && progress === null;
    status.textContent = progress === null
        ? `${formatCount(shown)} of ${formatCount(total)} points shown, ${formatCount(tiles)} of ${formatCount(allTiles)} tiles`
            + (part && failures.length === 0 ? ': the nearest in sight; "Points at most" shows more' : '')
        : `Loading tiles: ${formatCount(progress)} of ${formatCount(allTiles)}`;
    status.dataset.state = progress === null ? 'ready' : 'loading';
    Object.assign(status.dataset, {shown, total, tiles, allTiles});
    find('errors').textContent = failures.length === 0 ? ''
        : failures.length === 1 ? failures[0] : `${failures[0]} (and ${failures.length - 1} more tiles)`;
}

export function fail(error) {
    const status = find('status');
    status.textContent = 'Nothing to show';
    status.dataset.state = 'failed';
    find('errors').textContent = error.message;
}
