// Programs of WebGL2 with their uniforms by name.
export class NoWebGl extends Error {}

export interface Program {
  program: WebGLProgram;
  at: Record<string, WebGLUniformLocation | null>;
}

export function link(gl: WebGL2RenderingContext, vertex: string, fragment: string): Program {
  const program = gl.createProgram()!;
  for (const [type, source] of [
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ] as const) {
    const shader = gl.createShader(type)!;
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const logs = (gl.getAttachedShaders(program) ?? []).map((shader) => gl.getShaderInfoLog(shader)).join(' ');
    throw new NoWebGl(`The graphics driver refuses a program of the map: ${gl.getProgramInfoLog(program)} ${logs}`);
  }
  const at: Program['at'] = {};
  const count = gl.isContextLost() ? 0 : gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
  for (let i = 0; i < count; i++) {
    const name = gl.getActiveUniform(program, i)!.name.replace('[0]', '');
    at[name] = gl.getUniformLocation(program, name);
  }
  return { program, at };
}

export interface Attribute {
  at: number;
  size: number;
  type: 'f32' | 'u16' | 'u8';
  whole?: boolean; // an integer in the shader, too
  offset: number;
  stride: number;
}

// Sets attributes of the bound vertex array that advance once an instance, from the bound buffer.
export function instanced(gl: WebGL2RenderingContext, attributes: readonly Attribute[]) {
  for (const { at, size, type, whole, offset, stride } of attributes) {
    const glType = { f32: gl.FLOAT, u16: gl.UNSIGNED_SHORT, u8: gl.UNSIGNED_BYTE }[type];
    gl.enableVertexAttribArray(at);
    if (whole) gl.vertexAttribIPointer(at, size, glType, stride, offset);
    else gl.vertexAttribPointer(at, size, glType, false, stride, offset);
    gl.vertexAttribDivisor(at, 1);
  }
}
