// Shades points by their depth alone: what lies behind its neighbours on the screen is darker. Without normals this is
// what tells the shape (Boucheny, Visualisation scientifique de grands volumes de donnees, 2009).

import {
    DepthTexture, FloatType, Mesh, NearestFilter, OrthographicCamera, PlaneGeometry, Scene, ShaderMaterial, Vector2,
    WebGLRenderTarget,
} from 'three';

const kStrength = 120;
const kReach = 1.4;  // pixels of the screen

export class EyeDome {
    size = new Vector2();

    constructor() {
        this.target = new WebGLRenderTarget(1, 1, {minFilter: NearestFilter, magFilter: NearestFilter});
        this.target.depthTexture = new DepthTexture(1, 1, FloatType);
        this.material = new ShaderMaterial({
            depthTest: false,
            depthWrite: false,
            uniforms: {
                picture: {value: this.target.texture},
                depth: {value: this.target.depthTexture},
                reach: {value: new Vector2()},
                near: {value: 1},
                far: {value: 2},
            },
            vertexShader: `
                varying vec2 place;
                void main() {
                    place = uv;
                    gl_Position = vec4(position.xy, 0.0, 1.0);
                }`,
            fragmentShader: `
                uniform sampler2D picture;
                uniform sampler2D depth;
                uniform vec2 reach;
                uniform float near;
                uniform float far;
                varying vec2 place;
                // The logarithm of the distance, so that shade does not depend on the size of things.
                float distanceAt(vec2 at) {
                    float z = texture2D(depth, at).x;
                    return log2(near * far / (far - z * (far - near)));
                }
                void main() {
                    vec4 seen = texture2D(picture, place);
                    if (seen.a == 0.0) discard;
                    float here = distanceAt(place);
                    float behind = 0.0;
                    for (int k = 0; k < 8; ++k) {
                        float angle = float(k) * 0.78539816;
                        behind += max(0.0, here - distanceAt(place + reach * vec2(cos(angle), sin(angle))));
                    }
                    gl_FragColor = vec4(seen.rgb * exp(-${kStrength.toFixed(1)} * behind / 8.0), 1.0);
                }`,
        });
        this.scene = new Scene();
        this.scene.add(new Mesh(new PlaneGeometry(2, 2), this.material));
        this.scene.children[0].frustumCulled = false;
        this.camera = new OrthographicCamera(-1, 1, 1, -1, 0, 1);
    }

    setSize(width, height) {
        this.target.setSize(width, height);
        const reach = kReach * Math.min(devicePixelRatio, 2);
        this.material.uniforms.reach.value.set(reach / width, reach / height);
    }

    render(renderer, scene, camera) {
        const {uniforms} = this.material;
        uniforms.near.value = camera.near;
        uniforms.far.value = camera.far;
        renderer.setRenderTarget(this.target);
        renderer.clear();
        renderer.render(scene, camera);
        renderer.setRenderTarget(null);
        renderer.clear();
        renderer.render(this.scene, this.camera);
    }
}
