// Round points of a size in pixels, in the very colours that they are given.

import {ShaderMaterial} from 'three';

export function makePointMaterial() {
    return new ShaderMaterial({
        uniforms: {size: {value: 2}},
        vertexShader: `
            attribute vec4 tint;
            uniform float size;
            varying vec3 colour;
            void main() {
                colour = tint.rgb;
                gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
                gl_PointSize = size;
            }`,
        fragmentShader: `
            uniform float size;
            varying vec3 colour;
            void main() {
                vec2 place = 2.0 * gl_PointCoord - 1.0;
                if (size > 2.5 && dot(place, place) > 1.0) discard;
                gl_FragColor = vec4(colour, 1.0);
            }`,
    });
}
