// The picture: hull, arrows, ground and water, with plain WebGL 2.

import { add, along, lookAt, multiply, perspective, scale, transform, unit, sub, columns } from "./matrix.js";
import { arrowTriangles, gridLines, hullEdges, hullTriangles } from "./shapes.js";

const MAX_SURFACES = 64;
const FIELD_OF_VIEW = 0.5;
const FIRST_VIEW = { azimuth: 0.75, elevation: 0.42, distance: 3.1 };

/** Where the vehicle is seen from. */
export const CAMERAS = {
  corner: FIRST_VIEW,
  front: { azimuth: 0, elevation: 0.08, distance: 3.1 },
  left: { azimuth: Math.PI / 2, elevation: 0.08, distance: 3.1 },
  above: { azimuth: -Math.PI / 2, elevation: 1.5, distance: 3.1 },
};

const HULL = [`#version 300 es
in vec3 position; in vec3 normal; in float surface;
uniform mat4 world, view; uniform vec3 colors[${MAX_SURFACES}];
out vec3 color, n; out float height;
void main() {
  vec4 at = world * vec4(position, 1.0);
  color = colors[int(surface)]; n = mat3(world) * normal; height = at.z;
  gl_Position = view * at;
}`, `#version 300 es
precision highp float;
in vec3 color, n; in float height;
uniform float water, everywhere; uniform vec3 light, dry;
out vec4 fragment;
void main() {
  float shade = 0.74 + 0.26 * dot(normalize(n), light);
  float line = 1.0 - smoothstep(0.8, 1.8, abs(height - water) / max(fwidth(height), 1e-6));
  vec3 shown = height <= water ? color : mix(dry, color, everywhere);
  fragment = vec4(mix(shown * shade, vec3(0.04, 0.16, 0.36), line), 1.0);
}`];

const PLAIN = [`#version 300 es
in vec3 position; in vec3 normal;
uniform mat4 world, view;
out vec3 n, at;
void main() { vec4 p = world * vec4(position, 1.0); n = mat3(world) * normal; at = position; gl_Position = view * p; }`,
`#version 300 es
precision highp float;
in vec3 n, at;
uniform vec4 color; uniform vec3 light; uniform float fade, shaded;
out vec4 fragment;
void main() {
  float shade = mix(1.0, 0.7 + 0.3 * dot(normalize(n + vec3(0, 0, 1e-6)), light), shaded);
  float alpha = fade > 0.0 ? 1.0 - smoothstep(0.55, 1.0, length(at.xy) / fade) : 1.0;
  fragment = vec4(color.rgb * shade, color.a * alpha);
}`];

function program(gl, [vertex, fragment]) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return made;
}

export class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", { alpha: false });
    if (!this.gl) throw new Error("this browser has no WebGL 2, so the hull is not drawn; the numbers are complete");
    this.camera = { ...FIRST_VIEW };
    this.hull = program(this.gl, HULL);
    this.plain = program(this.gl, PLAIN);
    this.shapes = {
      arrow: this.shape(this.plain, arrowTriangles(), { position: 3, normal: 3 }),
      square: this.shape(this.plain, new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, -1, 0, 1, 1, 0, -1, 1, 0]), { position: 3 }),
    };
  }

  /** Numbers on the graphics card, so many a corner for each attribute. */
  shape(program, data, attributes) {
    const gl = this.gl;
    const [vertices, buffer] = [gl.createVertexArray(), gl.createBuffer()];
    const stride = Object.values(attributes).reduce((a, b) => a + b);
    gl.bindVertexArray(vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    let offset = 0;
    for (const [name, width] of Object.entries(attributes)) {
      const location = gl.getAttribLocation(program, name);
      if (location >= 0) {
        gl.enableVertexAttribArray(location);
        gl.vertexAttribPointer(location, width, gl.FLOAT, false, 4 * stride, 4 * offset);
      }
      offset += width;
    }
    return { vertices, buffer, count: data.length / stride };
  }

  free(...names) {
    for (const shape of names.map((name) => this.shapes[name]).filter(Boolean)) {
      this.gl.deleteVertexArray(shape.vertices);
      this.gl.deleteBuffer(shape.buffer);
    }
  }

  /** Takes another vehicle: the hull, or none where it is too large, and the length of the vehicle. */
  setHull(hull, length) {
    this.free("hull", "edges", "grid");
    this.length = length;
    this.half = Math.ceil((2 * length) / 0.25) * 0.25;
    this.shapes.grid = this.shape(this.plain, gridLines(this.half, 0.25), { position: 3 });
    this.shapes.hull = hull && this.shape(this.hull, hullTriangles(hull), { position: 3, normal: 3, surface: 1 });
    this.shapes.edges = hull && this.shape(this.plain, hullEdges(hull), { position: 3 });
  }

  eye() {
    const { azimuth, elevation, distance } = this.camera;
    const flat = Math.cos(elevation);
    return scale([flat * Math.cos(azimuth), flat * Math.sin(azimuth), Math.sin(elevation)], distance * this.length);
  }

  turn(dx, dy) {
    this.camera.azimuth -= 0.008 * dx;
    this.camera.elevation = Math.min(Math.max(this.camera.elevation + 0.006 * dy, -1.45), 1.5);
  }

  zoom(amount) {
    this.camera.distance = Math.min(Math.max(this.camera.distance * Math.exp(0.001 * amount), 1.2), 9);
  }

  look(camera) {
    this.camera = { ...CAMERAS[camera] };
  }

  /** Where a point of the world is in the picture [CSS pixels], or undefined behind the eye. */
  project(point) {
    const [x, y, , w] = transform(this.view, point);
    const { clientWidth, clientHeight } = this.canvas;
    return w > 0 ? [((x / w + 1) / 2) * clientWidth, ((1 - y / w) / 2) * clientHeight] : undefined;
  }

  /** The direction in the world in which a pixel is seen. */
  ray(x, y) {
    const { clientWidth, clientHeight } = this.canvas;
    const back = unit(this.eye());
    const right = unit([-back[1], back[0], 0]);
    const up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2], back[0] * right[1] - back[1] * right[0]];
    const t = Math.tan(FIELD_OF_VIEW / 2);
    const [h, v] = [((2 * x) / clientWidth - 1) * t * (clientWidth / clientHeight), (1 - (2 * y) / clientHeight) * t];
    return unit(sub(add(scale(right, h), scale(up, v)), back));
  }

  /**
   * Draws. `look` has the attitude (`world`), the height of the water in the world, z of the ground in the body, a color
   * for each surface, whether these hold above the water too (`everywhere`), the colors of `background` and of what is `dry`, and
   * arrows: `from`, `vector` in the world [m], `color`.
   */
  draw(look) {
    const gl = this.gl;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [this.canvas.clientWidth * ratio, this.canvas.clientHeight * ratio].map(Math.round);
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(...look.background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    const projection = perspective(FIELD_OF_VIEW, width / height, 0.05 * this.length, 30 * this.length);
    this.view = multiply(projection, lookAt(this.eye(), [0, 0, 0]));
    this.light = unit(add(unit(this.eye()), [0, 0, 0.6]));
    this.drawGround(look);
    if (this.shapes.hull) this.drawHull(look);
    this.drawWater(look);
    this.drawArrows(look.arrows);
  }

  begin(program, world) {
    const gl = this.gl;
    gl.useProgram(program);
    const uniform = (name) => gl.getUniformLocation(program, name);
    gl.uniformMatrix4fv(uniform("world"), false, world);
    gl.uniformMatrix4fv(uniform("view"), false, this.view);
    gl.uniform3fv(uniform("light"), this.light);
    return uniform;
  }

  plainly(shape, mode, world, color, { fade = 0, shaded = 0 } = {}) {
    const gl = this.gl;
    const uniform = this.begin(this.plain, world);
    gl.uniform4fv(uniform("color"), color);
    gl.uniform1f(uniform("fade"), fade);
    gl.uniform1f(uniform("shaded"), shaded);
    gl.bindVertexArray(shape.vertices);
    gl.drawArrays(mode, 0, shape.count);
  }

  drawGround({ world, ground }) {
    const at = multiply(world, columns([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, ground]));
    this.plainly(this.shapes.grid, this.gl.LINES, at, [0.45, 0.43, 0.4, 0.45], { fade: this.half });
  }

  drawHull({ world, water, colors, dry, everywhere }) {
    const gl = this.gl;
    const uniform = this.begin(this.hull, world);
    gl.uniform1f(uniform("water"), water);
    gl.uniform1f(uniform("everywhere"), Number(everywhere));
    gl.uniform3fv(uniform("dry"), dry);
    const all = new Float32Array(3 * MAX_SURFACES);
    all.set(colors.flat().slice(0, 3 * MAX_SURFACES));
    gl.uniform3fv(uniform("colors"), all);
    gl.bindVertexArray(this.shapes.hull.vertices);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 2);
    gl.drawArrays(gl.TRIANGLES, 0, this.shapes.hull.count);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    this.plainly(this.shapes.edges, gl.LINES, world, [0.1, 0.12, 0.14, 0.75]);
  }

  drawWater({ water }) {
    const half = 1.6 * this.length;
    const at = columns([half, 0, 0], [0, half, 0], [0, 0, 1], [0, 0, water]);
    this.gl.depthMask(false);
    this.plainly(this.shapes.square, this.gl.TRIANGLES, at, [0.2, 0.5, 0.85, 0.24], { fade: 1.25 });
    this.gl.depthMask(true);
  }

  /** Behind the hull they show through it, faintly. */
  drawArrows(arrows) {
    const gl = this.gl;
    const width = 0.022 * this.length;
    for (const [test, alpha] of [[gl.GREATER, 0.5], [gl.LEQUAL, 1]]) {
      gl.depthFunc(test);
      gl.depthMask(test === gl.LEQUAL);
      for (const { from, vector, color, wide = 1 } of arrows) {
        this.plainly(this.shapes.arrow, gl.TRIANGLES, along(from, vector, wide * width), [...color, alpha], { shaded: 1 });
      }
    }
    gl.depthFunc(gl.LESS);
  }
}
