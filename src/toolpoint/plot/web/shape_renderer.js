"use strict";
// Draws a scene and one of its shapes with WebGL2. The vertex shader forms x + scale Re((a + ib) exp(i phase)).
window.ToolpointRenderer = (function () {
  const VERTEX = `#version 300 es
precision highp float;
in vec3 position; in vec3 realPart; in vec3 imaginaryPart; in vec4 tint;
uniform mat4 view, projection; uniform vec2 phase, shift; uniform float scale, peak, pointSize;
uniform int colouring; uniform vec3 ramp[10];
out vec3 moved, seen, colour;
vec3 ramped(float t) {
  float s = clamp(t, 0.0, 1.0) * 9.0; int k = int(min(floor(s), 8.0));
  return mix(ramp[k], ramp[k + 1], s - float(k));
}
void main() {
  vec3 u = realPart * phase.x - imaginaryPart * phase.y;
  moved = position + scale * u;
  float amount = colouring == 1 ? length(u) : sqrt(dot(realPart, realPart) + dot(imaginaryPart, imaginaryPart));
  colour = tint.a < 0.5 ? vec3(0.6) : colouring == 2 ? tint.rgb : ramped(amount / peak);
  vec4 at = view * vec4(moved, 1.0);
  seen = at.xyz;
  gl_Position = projection * at;
  gl_Position.xy += shift * gl_Position.w;
  gl_PointSize = pointSize;
}`;
  // One program a kind of element, so that each computes only what it shows (software rendering feels the difference).
  const FACE = 0, EDGE = 1, WIRE = 2, DOT = 3;
  const FRAGMENT = `precision highp float;
in vec3 seen, colour; out vec4 pixel; uniform vec4 flatColour;
void main() {
#if KIND == 0
    vec3 n = normalize(cross(dFdx(seen), dFdy(seen)));
    float light = 0.62 + 0.38 * abs(dot(n, normalize(vec3(0.35, 0.55, 0.76))));
    pixel = vec4(colour * light, 1.0);
#elif KIND == 1
    pixel = vec4(flatColour.rgb * flatColour.a, flatColour.a);
#elif KIND == 3
    vec2 p = gl_PointCoord - 0.5; float r = dot(p, p); if (r > 0.25) discard;
    pixel = vec4(r > 0.14 ? flatColour.rgb : colour, 1.0);
#else
    pixel = vec4(colour, 1.0);
#endif
}`;

  function compiled(gl, type, source) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    return shader;
  }

  function linked(gl, kind) {
    const program = gl.createProgram();
    gl.attachShader(program, compiled(gl, gl.VERTEX_SHADER, VERTEX));
    gl.attachShader(program, compiled(gl, gl.FRAGMENT_SHADER, `#version 300 es\n#define KIND ${kind}\n` + FRAGMENT));
    ["position", "realPart", "imaginaryPart", "tint"].forEach((name, i) => gl.bindAttribLocation(program, i, name));
    if (kind === DOT) gl.transformFeedbackVaryings(program, ["moved"], gl.SEPARATE_ATTRIBS);
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    const at = {};
    for (const name of ["view", "projection", "phase", "shift", "scale", "peak", "pointSize", "colouring", "ramp",
      "flatColour"]) at[name] = gl.getUniformLocation(program, name);
    return { program, at };
  }

  class Renderer {
    constructor(canvas, ramp) {
      this.canvas = canvas;
      this.gl = canvas.getContext("webgl2", { antialias: false, alpha: false }); // a page blends an opaque picture for a third less
      if (!this.gl) throw new Error("no WebGL2 context");
      this.kinds = [FACE, EDGE, WIRE, DOT].map((kind) => linked(this.gl, kind));
      this.ramp = new Float32Array(ramp.flat()); this.panes = [];
      this.target = null;
    }

    bindTarget(samples) { // a smoothed off-screen picture, or the canvas itself where speed matters more
      const gl = this.gl, w = this.canvas.width, h = this.canvas.height, old = this.target;
      if (!samples) { gl.bindFramebuffer(gl.FRAMEBUFFER, null); return; }
      if (!old || old.w !== w || old.h !== h || old.samples !== samples) {
        if (old) { gl.deleteFramebuffer(old.frame); gl.deleteRenderbuffer(old.colour); gl.deleteRenderbuffer(old.depth); }
        const made = { w, h, samples, frame: gl.createFramebuffer(), colour: gl.createRenderbuffer(), depth: gl.createRenderbuffer() };
        gl.bindFramebuffer(gl.FRAMEBUFFER, made.frame);
        for (const [buffer, format, at] of [[made.colour, gl.RGB8, gl.COLOR_ATTACHMENT0],
          [made.depth, gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]]) {
          gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
          gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, format, w, h);
          gl.framebufferRenderbuffer(gl.FRAMEBUFFER, at, gl.RENDERBUFFER, buffer);
        }
        this.target = made;
      }
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.target.frame);
    }

    showTarget(samples) {
      if (!samples) return;
      const gl = this.gl, { w, h, frame } = this.target;
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, frame); gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
      gl.blitFramebuffer(0, 0, w, h, 0, 0, w, h, gl.COLOR_BUFFER_BIT, gl.NEAREST);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    }

    addPane(pane) { // pane: nodes Float32Array, tint Float32Array
      const gl = this.gl, own = { count: pane.nodes.length / 3, buffers: [] };
      own.array = gl.createVertexArray();
      gl.bindVertexArray(own.array);
      [[pane.nodes, 3], [null, 3], [null, 3], [pane.tint, 4]].forEach(([data, width], i) => {
        const buffer = gl.createBuffer();
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.bufferData(gl.ARRAY_BUFFER, data || own.count * 12, i === 0 || i === 3 ? gl.STATIC_DRAW : gl.DYNAMIC_DRAW);
        gl.enableVertexAttribArray(i);
        gl.vertexAttribPointer(i, width, gl.FLOAT, false, 0, 0);
        own.buffers.push(buffer);
      });
      own.faces = gl.createBuffer(); own.edges = gl.createBuffer(); own.dots = gl.createBuffer(); own.coarse = gl.createBuffer();
      own.faceCount = own.edgeCount = own.dotCount = own.coarseCount = 0; own.peak = 1; own.scale = 0;
      gl.bindVertexArray(null);
      this.panes.push(own);
    }

    setElements(k, faces, edges, dots, coarse) { // coarse: fewer faces between the same nodes, none for a small scene
      const gl = this.gl, own = this.panes[k];
      gl.bindVertexArray(null);
      for (const [buffer, data] of [[own.faces, faces], [own.edges, edges], [own.dots, dots], [own.coarse, coarse]]) {
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, data, gl.STATIC_DRAW);
      }
      own.faceCount = faces.length; own.edgeCount = edges.length; own.dotCount = dots.length; own.coarseCount = coarse.length;
    }

    setNodes(k, nodes) { // the same scene at another pose
      this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.panes[k].buffers[0]); this.gl.bufferSubData(this.gl.ARRAY_BUFFER, 0, nodes);
    }

    setShape(k, real, imaginary, peak) {
      const gl = this.gl, own = this.panes[k];
      gl.bindBuffer(gl.ARRAY_BUFFER, own.buffers[1]); gl.bufferSubData(gl.ARRAY_BUFFER, 0, real);
      gl.bindBuffer(gl.ARRAY_BUFFER, own.buffers[2]); gl.bufferSubData(gl.ARRAY_BUFFER, 0, imaginary);
      own.peak = peak > 0 ? peak : 1;
    }

    draw(state) { // state: view, projection, phase, scales, colouring, level, edge and ghost colours, backdrop (colours of its upper and lower end), ratio
      const gl = this.gl, w = this.canvas.width, h = this.canvas.height, n = this.panes.length;
      const samples = state.level ? 0 : 4;
      this.bindTarget(samples);
      gl.enable(gl.DEPTH_TEST); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      this.clear(state.backdrop, w, h);
      for (let k = 0; k < n; k++) {
        const left = Math.round(k * w / n), width = Math.round((k + 1) * w / n) - left;
        gl.viewport(left, 0, width, h);
        this.pixel = [2 * state.ratio / width, 2 * state.ratio / h];
        this.drawPane(this.panes[k], state, state.scales[k]);
      }
      this.showTarget(samples);
    }

    clear([upper, lower], w, h) { // a gradient of as many bands as there are shades between its ends
      const gl = this.gl, count = Math.min(h, 1 + Math.max(...upper.map((v, i) => Math.abs(v - lower[i]))));
      gl.enable(gl.SCISSOR_TEST);
      for (let i = 0; i < count; i++) {
        const share = count > 1 ? i / (count - 1) : 0, from = Math.round(i * h / count);
        gl.clearColor(...lower.map((v, j) => (v + share * (upper[j] - v)) / 255), 1);
        gl.scissor(0, from, w, Math.round((i + 1) * h / count) - from);
        gl.clear(gl.COLOR_BUFFER_BIT);
      }
      gl.disable(gl.SCISSOR_TEST); gl.clear(gl.DEPTH_BUFFER_BIT);
    }

    use(kind, own, state, scale) {
      const gl = this.gl, { program, at } = this.kinds[kind];
      gl.useProgram(program);
      gl.uniformMatrix4fv(at.view, false, state.view); gl.uniformMatrix4fv(at.projection, false, state.projection);
      gl.uniform3fv(at.ramp, this.ramp); gl.uniform1i(at.colouring, state.colouring); gl.uniform1f(at.peak, own.peak);
      gl.uniform2f(at.phase, Math.cos(state.phase), Math.sin(state.phase)); gl.uniform1f(at.scale, scale);
      gl.uniform2f(at.shift, 0, 0); gl.uniform4fv(at.flatColour, state.edge); gl.uniform1f(at.pointSize, 8 * state.ratio);
      return at;
    }

    drawPane(own, state, scale) {
      const gl = this.gl, wire = own.faceCount === 0, large = own.edgeCount > 8000;
      gl.bindVertexArray(own.array);
      gl.disable(gl.BLEND);
      if (!wire) {
        this.use(FACE, own, state, scale);
        gl.enable(gl.POLYGON_OFFSET_FILL); gl.polygonOffset(1, 2);
        if (state.level > 3 && own.coarseCount) this.elements(gl.TRIANGLES, own.coarse, own.coarseCount);
        else this.elements(gl.TRIANGLES, own.faces, own.faceCount);
        gl.disable(gl.POLYGON_OFFSET_FILL);
      }
      if (wire || !large || state.level < 3) this.drawEdges(own, state, scale, wire, large);
      if (own.dotCount) { this.use(DOT, own, state, scale); this.elements(gl.POINTS, own.dots, own.dotCount); }
      if (state.ghost && (!large || state.level < 2)) {
        gl.enable(gl.BLEND);
        gl.uniform4fv(this.use(EDGE, own, state, 0).flatColour, state.ghost);
        this.elements(gl.LINES, own.edges, own.edgeCount);
      }
    }

    drawEdges(own, state, scale, wire, large) { // a wire model's lines are drawn five times, shifted, to be thick
      const gl = this.gl, at = this.use(wire ? WIRE : EDGE, own, state, scale);
      if (!wire && !state.level) gl.enable(gl.BLEND);
      for (const [x, y] of wire && !large ? [[0, 0], [.8, 0], [-.8, 0], [0, .8], [0, -.8]] : [[0, 0]]) {
        gl.uniform2f(at.shift, x * this.pixel[0], y * this.pixel[1]);
        this.elements(gl.LINES, own.edges, own.edgeCount);
      }
    }

    elements(mode, buffer, count) {
      if (!count) return;
      this.gl.bindBuffer(this.gl.ELEMENT_ARRAY_BUFFER, buffer);
      this.gl.drawElements(mode, count, this.gl.UNSIGNED_INT, 0);
    }

    moved(k, phase, scale) { // positions as the vertex shader computes them, read back by transform feedback
      const gl = this.gl, own = this.panes[k], result = new Float32Array(own.count * 3);
      const buffer = gl.createBuffer(), feedback = gl.createTransformFeedback();
      const { program, at } = this.kinds[DOT];
      gl.useProgram(program); gl.bindVertexArray(own.array);
      gl.uniform2f(at.phase, Math.cos(phase), Math.sin(phase)); gl.uniform1f(at.scale, scale);
      gl.bindBuffer(gl.ARRAY_BUFFER, null);
      gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, feedback);
      gl.bindBuffer(gl.TRANSFORM_FEEDBACK_BUFFER, buffer);
      gl.bufferData(gl.TRANSFORM_FEEDBACK_BUFFER, result.byteLength, gl.STREAM_READ);
      gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, buffer);
      gl.enable(gl.RASTERIZER_DISCARD);
      gl.beginTransformFeedback(gl.POINTS); gl.drawArrays(gl.POINTS, 0, own.count); gl.endTransformFeedback();
      gl.disable(gl.RASTERIZER_DISCARD);
      gl.getBufferSubData(gl.TRANSFORM_FEEDBACK_BUFFER, 0, result);
      gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, null);
      gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, null);
      gl.deleteBuffer(buffer); gl.deleteTransformFeedback(feedback); gl.bindVertexArray(null);
      return result;
    }
  }
  return Renderer;
})();
