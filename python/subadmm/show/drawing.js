// What pages draw a world with (WebGL 2): player.html and hands/page.html have this text in them. `head`, of all
// functions: the header that page.py makes, drawing_of().

// A part of the data, [type, offset in bytes, count].
const types = { f32: Float32Array, i32: Int32Array, u8: Uint8Array, i8: Int8Array };
const section = (buffer, [type, at, count]) => new types[type](buffer, at, count);

// ---- small linear algebra; matrices in columns, as WebGL has them -------------------------------------------------

const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const l = Math.hypot(...a) || 1; return [a[0] / l, a[1] / l, a[2] / l]; };
function product(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; ++c) for (let r = 0; r < 4; ++r)
    for (let k = 0; k < 4; ++k) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}
function lookAt(eye, target, up) {
  const z = unit(sub(eye, target)), x = unit(cross(up, z)), y = cross(z, x);
  return new Float32Array([x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye),
    -dot(z, eye), 1]);
}
function perspective(field, aspect, near, far) {
  const f = 1 / Math.tan(field / 2);
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0,
    2 * far * near / (near - far), 0]);
}
const parallel = (r, near, far) => new Float32Array([1 / r, 0, 0, 0, 0, 1 / r, 0, 0, 0, 0, 2 / (near - far), 0, 0, 0,
  (far + near) / (near - far), 1]);

// ---- shaders ------------------------------------------------------------------------------------------------------

const vertexText = `#version 300 es
precision highp float;
layout(location = 0) in vec3 corner;
layout(location = 1) in vec3 cornerNormal;
layout(location = 2) in float body;
layout(location = 3) in vec3 place;
layout(location = 4) in vec4 turn;
layout(location = 5) in vec3 scale;
layout(location = 6) in vec3 colour;
layout(location = 7) in vec4 wall;
uniform highp sampler2D poses;
uniform mat4 toClip, toSun;
uniform vec3 eye;
uniform bool hideWalls;
out vec3 at, normal, own, sunPlace;
vec3 turned(vec4 q, vec3 v) { vec3 t = 2.0 * cross(q.yzw, v); return v + q.x * t + cross(q.yzw, t); }
void main() {
  int texel = 2 * int(body);
  vec3 where = texelFetch(poses, ivec2(texel % 1024, texel / 1024), 0).xyz;
  vec4 way = texelFetch(poses, ivec2(texel % 1024 + 1, texel / 1024), 0);
  at = where + turned(way, place + turned(turn, scale * corner));
  normal = turned(way, turned(turn, cornerNormal / scale));
  own = pow(colour, vec3(2.2));
  sunPlace = (toSun * vec4(at, 1.0)).xyz * 0.5 + 0.5;
  gl_Position = toClip * vec4(at, 1.0);
  if (hideWalls && dot(wall.xyz, wall.xyz) > 0.5 && dot(wall.xyz, eye) > wall.w) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}`;
// An arrow: its corners by (across, across, radius in units of `thin`, 0 at the start, 1 at the head's base, 2 at the
// tip).
const arrowText = `#version 300 es
precision highp float;
layout(location = 0) in vec4 corner;
layout(location = 1) in vec3 start;
layout(location = 2) in vec3 way;
layout(location = 3) in vec3 colour;
uniform mat4 toClip;
uniform float thin;
out vec3 normal, own;
void main() {
  float size = max(length(way), 1e-12), head = min(6.0 * thin, 0.6 * size);
  vec3 z = way / size, x = normalize(cross(z, abs(z.z) < 0.9 ? vec3(0, 0, 1) : vec3(1, 0, 0))), y = cross(z, x);
  normal = x * corner.x + y * corner.y;
  float along = corner.w < 0.5 ? 0.0 : corner.w < 1.5 ? size - head : size;
  own = colour;
  gl_Position = toClip * vec4(start + z * along + normal * corner.z * thin, 1.0);
}`;
const arrowColourText = `#version 300 es
precision highp float;
in vec3 normal, own;
uniform vec3 sun;
out vec4 result;
void main() { result = vec4(own * (0.85 + 0.15 * dot(normalize(normal), sun)), 1.0); }`;
const fragmentText = `#version 300 es
precision highp float;
in vec3 at, normal, own, sunPlace;
uniform highp sampler2DShadow shadow;
uniform vec3 sun, centre;
uniform float radius, pale;
uniform bool ground;
out vec4 result;
const vec3 backdrop = vec3(0.93, 0.945, 0.965);
float sunlit() {
  if (any(lessThan(sunPlace, vec3(0.0))) || any(greaterThan(sunPlace, vec3(1.0)))) return 1.0;
  float sum = 0.0;
  for (int i = 0; i < 16; ++i) {
    vec2 offset = vec2(float(i % 4) - 1.5, float(i / 4) - 1.5) / 2048.0;
    sum += texture(shadow, vec3(sunPlace.xy + offset, sunPlace.z));
  }
  return sum / 16.0;
}
void main() {
  vec3 n = normalize(normal);
  float facing = max(dot(n, sun), 0.0);
  float sky = 0.5 + 0.5 * n.z;
  vec3 light = facing * (facing > 0.0 ? sunlit() : 0.0) * vec3(1.0, 0.95, 0.86) * 0.82
    + sky * vec3(0.86, 0.93, 1.0) * 0.55 + (1.0 - sky) * vec3(0.92, 0.88, 0.82) * 0.26;
  vec3 colour = own * light;
  if (ground) {
    float away = length(at.xy - centre.xy) / radius;
    colour = mix(colour, pow(backdrop, vec3(2.2)), pow(clamp((away - 1.8) / 5.0, 0.0, 1.0), 0.8));
  }
  result = vec4(mix(pow(clamp(colour, 0.0, 1.0), vec3(1.0 / 2.2)), backdrop, pale), 1.0);
}`;
const emptyText = `#version 300 es
precision highp float;
void main() {}`;

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const places = {};
  for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); ++k) {
    const name = gl.getActiveUniform(made, k).name;
    places[name] = gl.getUniformLocation(made, name);
  }
  return { made, places };
}

// ---- drawing ------------------------------------------------------------------------------------------------------

// texels: 8 numbers a body, x y z 0 and w x y z, to be set before something is drawn. draw(camera, arrows): on the
// canvas, by a camera of orbit(). For other views: prepare(eye), then view(...) for each. free(): another
// renderer takes its place.
function renderer(canvas, head, buffer) {
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) throw new Error("this browser has no WebGL 2");
  const owned = [], made = (kind) => { owned.push([kind, gl["create" + kind]()]); return owned[owned.length - 1][1]; };
  const main = program(gl, vertexText, fragmentText), dark = program(gl, vertexText, emptyText);

  const groups = head.groups.map((group) => {
    const array = made("VertexArray");
    gl.bindVertexArray(array);
    const put = (location, values, size, type, normal, divisor) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, made("Buffer"));
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, type, normal, 0, 0);
      gl.vertexAttribDivisor(location, divisor);
    };
    const corners = section(buffer, group.corners);
    put(0, corners, 3, gl.FLOAT, false, 0);
    put(1, section(buffer, group.normals), 3, gl.BYTE, true, 0);
    put(2, Float32Array.from(section(buffer, group.body)), 1, gl.FLOAT, false, 1);
    put(3, section(buffer, group.place), 3, gl.FLOAT, false, 1);
    put(4, section(buffer, group.turn), 4, gl.FLOAT, false, 1);
    put(5, section(buffer, group.scale), 3, gl.FLOAT, false, 1);
    put(6, section(buffer, group.colour), 3, gl.UNSIGNED_BYTE, true, 1);
    put(7, section(buffer, group.wall), 4, gl.FLOAT, false, 1);
    return { array, corners: corners.length / 3, instances: group.body[2], ground: group.ground };
  });

  const arrow = program(gl, arrowText, arrowColourText), arrowArray = made("VertexArray"),
    arrowData = made("Buffer");
  const arrowCorners = [];
  for (let k = 0; k < 8; ++k) {
    const [a, b] = [k, k + 1].map((i) => [Math.cos(i * Math.PI / 4), Math.sin(i * Math.PI / 4)]);
    arrowCorners.push(...a, 1, 0, ...b, 1, 0, ...b, 1, 1, ...a, 1, 0, ...b, 1, 1, ...a, 1, 1);
    arrowCorners.push(...a, 2.5, 1, ...b, 2.5, 1, ...a, 0, 2);
  }
  gl.bindVertexArray(arrowArray);
  gl.bindBuffer(gl.ARRAY_BUFFER, made("Buffer"));
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(arrowCorners), gl.STATIC_DRAW);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 4, gl.FLOAT, false, 0, 0);
  gl.bindBuffer(gl.ARRAY_BUFFER, arrowData);
  for (let k = 0; k < 3; ++k) {
    gl.enableVertexAttribArray(k + 1);
    gl.vertexAttribPointer(k + 1, 3, gl.FLOAT, false, 36, 12 * k);
    gl.vertexAttribDivisor(k + 1, 1);
  }

  const rows = Math.max(Math.ceil(2 * head.bodies / 1024), 1), texels = new Float32Array(rows * 1024 * 4);
  const poses = made("Texture");
  gl.bindTexture(gl.TEXTURE_2D, poses);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 1024, rows, 0, gl.RGBA, gl.FLOAT, null);
  for (const which of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, which,
    gl.NEAREST);

  const shadow = made("Texture");
  gl.bindTexture(gl.TEXTURE_2D, shadow);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.DEPTH_COMPONENT24, 2048, 2048, 0, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT, null);
  for (const which of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, which, gl.LINEAR);
  for (const which of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, which, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
  const frame = made("Framebuffer");
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, shadow, 0);

  const sunEye = add(head.centre, head.sun, 20 * head.radius);
  const toSun = product(parallel(1.7 * head.radius, head.radius, 40 * head.radius), lookAt(sunEye, head.centre, [0,
    1, 0]));

  function pass(which, toClip, eye, hideWalls, pale) {
    gl.useProgram(which.made);
    const u = which.places;
    gl.uniform1i(u.poses, 0);
    gl.uniformMatrix4fv(u.toClip, false, toClip);
    gl.uniformMatrix4fv(u.toSun, false, toSun);
    gl.uniform3fv(u.eye, eye);
    gl.uniform1i(u.hideWalls, hideWalls);
    gl.uniform1i(u.shadow, 1);
    gl.uniform3fv(u.sun, head.sun);
    gl.uniform3fv(u.centre, head.centre);
    gl.uniform1f(u.radius, head.radius);
    gl.uniform1f(u.pale, pale);
    for (const group of groups) {
      if (u.ground) gl.uniform1i(u.ground, group.ground);
      else if (group.ground) continue;
      gl.bindVertexArray(group.array);
      gl.drawArraysInstanced(gl.TRIANGLES, 0, group.corners, group.instances);
    }
  }

  function drawArrows(arrows, toClip) {
    gl.useProgram(arrow.made);
    const u = arrow.places;
    gl.uniformMatrix4fv(u.toClip, false, toClip);
    gl.uniform3fv(u.sun, head.sun);
    gl.uniform1f(u.thin, 0.003 * head.radius);
    gl.bindVertexArray(arrowArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, arrowData);
    gl.bufferData(gl.ARRAY_BUFFER, arrows, gl.DYNAMIC_DRAW);
    gl.disable(gl.CULL_FACE);
    gl.clear(gl.DEPTH_BUFFER_BIT); // most are inside of bodies: they are seen through them
    gl.drawArraysInstanced(gl.TRIANGLES, 0, arrowCorners.length / 4, arrows.length / 9);
  }

  // Bodies are where the texels say, and their shadows; eye: walls that hide the middle from it cast none.
  function prepare(eye) {
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, poses);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 1024, rows, gl.RGBA, gl.FLOAT, texels);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.viewport(0, 0, 2048, 2048);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(2.5, 4);
    pass(dark, toSun, eye, true, 0);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.bindTexture(gl.TEXTURE_2D, shadow);
  }

  // An empty framebuffer; null: the canvas.
  function begin(target) {
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.clearColor(0.93, 0.945, 0.965, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  // What is seen from `eye`, in a viewport [x, y, width, height] of what begin() has emptied.
  function view([x, y, width, height], toClip, eye, hideWalls, arrows) {
    gl.viewport(x, y, width, height);
    gl.enable(gl.CULL_FACE);
    pass(main, toClip, eye, hideWalls, arrows ? 0.55 : 0); // arrows stand out from what is pale
    if (arrows && arrows.length) drawArrows(arrows, toClip);
    const error = gl.getError();
    if (error) throw new Error("WebGL error " + error);
  }

  return {
    gl, texels, prepare, begin, view,
    free() {
      for (const [kind, one] of owned) gl["delete" + kind](one);
      for (const one of [main, dark, arrow]) gl.deleteProgram(one.made);
    },
    draw(camera, arrows) {
      const ratio = Math.min(window.devicePixelRatio || 1, 2);
      const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
      if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
      const eye = camera.eye(), far = camera.distance + 25 * head.radius;
      const toClip = product(perspective(head.field, width / Math.max(height, 1), Math.max(0.02 * camera.distance,
        far * 1e-4), far), lookAt(eye, camera.target, [0, 0, 1]));
      prepare(eye);
      begin(null);
      view([0, 0, width, height], toClip, eye, true, arrows);
    },
  };
}

// The camera: drag turns, drag with the right button or shift moves, the wheel comes nearer.
function orbit(canvas, head, changed) {
  const back = sub(head.eye, head.target);
  const camera = {
    target: head.target.slice(), distance: Math.hypot(...back), azimuth: Math.atan2(back[1], back[0]),
    elevation: Math.asin(back[2] / Math.hypot(...back)),
    eye() {
      const c = Math.cos(this.elevation);
      return add(this.target, [Math.cos(this.azimuth) * c, Math.sin(this.azimuth) * c, Math.sin(this.elevation)],
        this.distance);
    },
  };
  const fingers = new Map();
  const zoom = (factor) => { camera.distance = Math.min(Math.max(camera.distance * factor, 0.05 * head.radius),
    20 * head.radius); changed(); };
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, event); });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end,
    (event) => fingers.delete(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    const last = fingers.get(event.pointerId);
    if (!last) return;
    const dx = event.clientX - last.clientX, dy = event.clientY - last.clientY;
    if (fingers.size === 2) {
      const other = [...fingers.values()].find((finger) => finger.pointerId !== event.pointerId);
      const length = (finger) => Math.hypot(finger.clientX - other.clientX, finger.clientY - other.clientY) || 1;
      zoom(length(last) / length(event));
    } else if (event.buttons & 2 || event.shiftKey) {
      const z = unit(sub(camera.eye(), camera.target)), x = unit(cross([0, 0, 1], z)), y = cross(z, x);
      const size = 2 * camera.distance * Math.tan(head.field / 2) / canvas.clientHeight;
      camera.target = add(add(camera.target, x, -dx * size), y, dy * size);
    } else {
      camera.azimuth -= dx * 0.008;
      camera.elevation = Math.min(Math.max(camera.elevation + dy * 0.008, -1.5), 1.5);
    }
    fingers.set(event.pointerId, event);
    changed();
  });
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(event.deltaY * 0.001));
    }, { passive: false });
  return camera;
}
