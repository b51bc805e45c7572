// Colours for numbers: evenly spaced to the eye, light for what is large, on a dark ground.

// Lightness, strength and hue in degrees of Oklch (Ottosson, A perceptual color space for image processing, 2020).
const kAnchors = [
    [0.42, 0.13, 292], [0.52, 0.12, 258], [0.62, 0.11, 215], [0.72, 0.14, 160], [0.82, 0.17, 122], [0.93, 0.16, 102],
];
const kSteps = 256;

// Of classes: apart from each other, the first for what has none.
const kClasses = [
    '#9aa7b4', '#c7ccd1', '#b08457', '#a7d46f', '#5fb04a', '#2f7d32', '#e4694c', '#e83e8c', '#7c6be0', '#4aa3ff',
    '#b3b300', '#6b7785', '#f2c14e', '#00b8a9', '#c06be0', '#ff9f68',
].map((text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16)));

export const kPlain = [214, 209, 196];

function toScreen(light) {
    const v = Math.min(1, Math.max(0, light));
    return Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
}

function screenColour(lightness, a, b) {
    const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
    const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
    const s = (lightness - 0.0894841775 * a - 1.2914855480 * b) ** 3;
    return [
        toScreen(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
        toScreen(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
        toScreen(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s),
    ];
}

function makeRamp() {
    return Array.from({length: kSteps}, (_, step) => {
        const at = step / (kSteps - 1) * (kAnchors.length - 1);
        const first = Math.min(Math.floor(at), kAnchors.length - 2);
        const [from, to] = [kAnchors[first], kAnchors[first + 1]]
            .map(([lightness, chroma, hue]) => [lightness, chroma * Math.cos(hue * Math.PI / 180),
                chroma * Math.sin(hue * Math.PI / 180)]);
        return screenColour(...from.map((value, k) => value + (at - first) * (to[k] - value)));
    });
}

const kRamp = makeRamp();

/// @param place  0 to 1; what is beyond has the colour of the end
export function rampColour(place) {
    return kRamp[Math.min(kSteps - 1, Math.max(0, Math.round(place * (kSteps - 1))))] ?? kPlain;
}

export function classColour(number) {
    return kClasses[((number % kClasses.length) + kClasses.length) % kClasses.length];
}

/// The ramp as a background for the legend.
export function rampGradient() {
    const stops = Array.from({length: 9}, (_, k) => `rgb(${rampColour(k / 8).join(' ')})`);
    return `linear-gradient(to right, ${stops.join(', ')})`;
}
