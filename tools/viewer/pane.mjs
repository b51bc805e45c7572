// A canvas with a cloud, a camera and what moves it.

import {Box3, Frustum, Group, Matrix4, PerspectiveCamera, Scene, Spherical, Vector3, WebGLRenderer} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {EyeDome} from './eye_dome.mjs';

const kFieldOfView = 40;  // degrees
// From the middle of the cloud to the camera, where up is z.
export const kDirections = {
    fit: [-0.55, -1, 0.6], top: [0, -1e-4, 1], front: [0, -1, 0], side: [1, 0, 0],
};

export class Pane {
    /// @param moved  called when the user has moved the camera
    constructor(canvas, cloud, radius, moved) {
        this.canvas = canvas;
        this.cloud = cloud;
        this.radius = radius;
        this.renderer = new WebGLRenderer({canvas, antialias: false, alpha: true, powerPreference: 'high-performance'});
        this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
        this.eyeDome = new EyeDome();
        this.shaded = true;
        this.scene = new Scene();
        this.turned = new Group();  // so that up is z
        this.turned.add(cloud.group);
        this.scene.add(this.turned);
        this.camera = new PerspectiveCamera(kFieldOfView, 1, 1, 2);
        this.camera.up.set(0, 0, 1);
        this.controls = new OrbitControls(this.camera, canvas);
        this.controls.zoomToCursor = true;
        this.controls.addEventListener('change', () => {
            this.invalidate();
            moved(this);
        });
        this.pending = false;
        new ResizeObserver(() => this.#resize()).observe(canvas.parentElement);
        this.#resize();
    }

    /// Draws once before the next picture of the screen.
    invalidate() {
        if (this.pending) return;
        this.pending = true;
        requestAnimationFrame(() => {
            this.pending = false;
            this.#draw();
        });
    }

    #draw() {
        const distance = this.camera.position.length();
        this.camera.near = Math.max(distance - 1.1 * this.radius, 1e-4 * this.radius);
        this.camera.far = distance + 1.1 * this.radius;
        this.camera.updateProjectionMatrix();
        if (this.shaded) {
            this.eyeDome.render(this.renderer, this.scene, this.camera);
        } else {
            this.renderer.render(this.scene, this.camera);
        }
        const {position} = this.camera;
        const {target} = this.controls;
        this.canvas.dataset.camera = [...position.toArray(), ...target.toArray()]
            .map((value) => (value / this.radius).toFixed(4)).join(' ');
    }

    #resize() {
        const {clientWidth: width, clientHeight: height} = this.canvas.parentElement;
        if (width === 0 || height === 0) return;
        this.renderer.setSize(width, height, false);
        this.eyeDome.setSize(...this.renderer.getDrawingBufferSize(this.eyeDome.size).toArray());
        this.camera.aspect = width / height;
        this.invalidate();
    }

    /// Looks at the whole cloud from one of kDirections.
    look(name) {
        this.#resize();
        const half = Math.tan(kFieldOfView * Math.PI / 360) * Math.min(1, this.camera.aspect);
        const distance = this.radius / Math.sin(Math.atan(half));
        this.controls.target.set(0, 0, 0);
        this.camera.position.fromArray(kDirections[name]).normalize().multiplyScalar(0.92 * distance);
        this.controls.update();
        this.invalidate();
    }

    /// Turns around the target by angles in radians, and goes nearer or farther.
    turn(around, upwards, factor) {
        const offset = this.camera.position.clone().sub(this.controls.target);
        const yUp = new Vector3(offset.x, offset.z, -offset.y);
        const place = new Spherical().setFromVector3(yUp);
        place.theta += around;
        place.phi = Math.min(Math.PI - 1e-3, Math.max(1e-3, place.phi - upwards));
        place.radius *= factor;
        yUp.setFromSpherical(place);
        this.camera.position.copy(this.controls.target).add(offset.set(yUp.x, -yUp.z, yUp.y));
        this.controls.update();
        this.invalidate();
    }

    /// Takes the camera of another pane.
    follow(other) {
        this.camera.position.copy(other.camera.position);
        this.controls.target.copy(other.controls.target);
        this.camera.lookAt(this.controls.target);
        this.camera.updateMatrixWorld();
        this.invalidate();
    }

    /// @param axis  1: y is up, 2: z
    setUp(axis) {
        this.turned.rotation.x = axis === 1 ? Math.PI / 2 : 0;
        this.turned.updateMatrixWorld(true);
        this.invalidate();
    }

    /// The camera's place in the archive's frame, and a test whether a box there is seen.
    sight() {
        this.camera.updateMatrixWorld();
        this.turned.updateMatrixWorld(true);
        const {origin} = this.cloud;
        const back = this.turned.matrixWorld.clone().invert();
        const eye = this.camera.position.clone().applyMatrix4(back).toArray().map((v, axis) => v + origin[axis]);
        const frustum = new Frustum().setFromProjectionMatrix(new Matrix4()
            .multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse)
            .multiply(this.turned.matrixWorld));
        const moved = (corner) => new Vector3().fromArray(corner.map((v, axis) => v - origin[axis]));
        return {eye, inSight: ({min, max}) => frustum.intersectsBox(new Box3(moved(min), moved(max)))};
    }
}
