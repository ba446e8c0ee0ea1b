// The programs of the renderer. Positions are metres from a tile's origin; pixels are those of the device.

const common = `#version 300 es
precision highp float;
precision highp int;
`;

// What all vertex shaders share.
const vertexCommon = `${common}
uniform vec2 u_offset;  // of the tile's origin from the picture's middle, metres
uniform float u_unit;
uniform mat2 u_turn;    // metres to pixels
uniform vec2 u_half;    // half of the picture's size, pixels
uniform float u_ease;   // 0: where it was in the layout before, 1: where it is
uniform float u_until;  // seconds since the first frame
uniform highp sampler2D u_sessions;
uniform sampler2D u_scale;
uniform int u_colour;
uniform int u_faint;    // 1: only sessions that were not chosen, 0: only the others
uniform vec2 u_range;   // seconds: from first to last frame, to the end of what is shown
uniform vec3 u_ground, u_dim, u_measured, u_guess, u_carried;

const vec4 kNowhere = vec4(2.0, 2.0, 2.0, 1.0);

vec2 pixelsOf(vec2 p) { return u_turn * (p + u_offset); }
vec4 screen(vec2 pixels) { return vec4(pixels / u_half, 0.0, 1.0); }
vec4 session(uint number) {
  int slot = int(number) & 4095;
  return texelFetch(u_sessions, ivec2(slot & 63, slot >> 6), 0);
}
bool left(uint number) { return (session(number).a < 0.5) != (u_faint == 1); }
vec3 scale(float share) { return texture(u_scale, vec2(clamp(share, 0.002, 0.998), 0.5)).rgb; }
vec3 colourOf(uint number, float time, float sd, uint flags) {
  vec4 of_session = session(number);
  vec3 colour = of_session.rgb;
  if (u_colour == 1) colour = time < 0.0 ? u_dim : scale(time / max(u_range.x, 1.0));
  if (u_colour == 2)
    colour = time < 0.0 ? u_dim
           : scale(1.0 - log(1.0 + max(0.0, u_range.y - time) / 10.0) / log(1.0 + max(10.0, u_range.x) / 10.0));
  if (u_colour == 3) colour = sd < 0.0 || isinf(sd) ? u_dim : scale(log(max(sd, 0.01) / 0.01) / log(1.0e4));
  if (u_colour == 4) colour = (flags & 2u) != 0u ? u_carried : (flags & 1u) != 0u ? u_guess : u_measured;
  return mix(u_ground, colour, of_session.a);
}
`;

// A segment of a line, four corners an instance: from the vertex before to this one.
export const lineVertex = `${vertexCommon}
layout(location = 0) in vec2 a_before;
layout(location = 1) in vec2 a_this;
layout(location = 2) in uint a_session;
layout(location = 3) in uint a_flags;   // those of the tile; 16: the first of its run
layout(location = 4) in float a_time;
layout(location = 5) in float a_sd;
layout(location = 6) in vec2 a_oldBefore;
layout(location = 7) in vec2 a_oldThis;
uniform float u_width;
out vec2 v_at;      // along and across the segment, pixels
out vec2 v_place;   // metres from the tile's origin
flat out float v_length;
flat out vec3 v_colour;
flat out uint v_flags;
void main() {
  if ((a_flags & 16u) != 0u || a_time > u_until || left(a_session)) { gl_Position = kNowhere; return; }
  vec2 before = a_before * u_unit, here = a_this * u_unit;
  if (u_ease < 1.0) { before = mix(a_oldBefore, before, u_ease); here = mix(a_oldThis, here, u_ease); }
  vec2 from = pixelsOf(before), to = pixelsOf(here);
  vec2 way = to - from;
  float len = length(way);
  vec2 along = len > 1.0e-4 ? way / len : vec2(1.0, 0.0);
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  float reach = 0.5 * u_width + 1.0;
  v_at = vec2(mix(-reach, len + reach, corner.x), mix(-reach, reach, corner.y));
  v_length = len;
  v_place = mix(before, here, len > 1.0e-4 ? v_at.x / len : 0.0);
  v_colour = colourOf(a_session, a_time, a_sd, a_flags);
  v_flags = a_flags;
  gl_Position = screen(from + along * v_at.x + vec2(-along.y, along.x) * v_at.y);
}`;

export const lineFragment = `${common}
in vec2 v_at;
in vec2 v_place;
flat in float v_length;
flat in vec3 v_colour;
flat in uint v_flags;
uniform float u_width;
uniform float u_check;  // metres: the pattern of guesses
uniform vec4 u_only;    // metres from the tile's origin: only what lies in this box
out vec4 o_colour;
void main() {
  if (v_place.x < u_only.x || v_place.y < u_only.y || v_place.x > u_only.z || v_place.y > u_only.w) discard;
  float away = length(vec2(v_at.x - clamp(v_at.x, 0.0, v_length), v_at.y));
  float alpha = clamp(0.5 * u_width + 0.5 - away, 0.0, 1.0);
  if ((v_flags & 1u) != 0u) {
    ivec2 cell = ivec2(floor(v_place / u_check));
    if (((cell.x + cell.y) & 1) != 0) alpha = 0.0;
  }
  o_colour = vec4(v_colour * alpha, alpha);
}`;

// Dots of frames, and larger ones at the ends of sessions; or arrows along the way that was driven.
export const dotVertex = `${vertexCommon}
layout(location = 0) in vec2 a_before;
layout(location = 1) in vec2 a_this;
layout(location = 2) in uint a_session;
layout(location = 3) in uint a_flags;
layout(location = 4) in float a_time;
layout(location = 5) in float a_sd;
layout(location = 6) in vec2 a_oldBefore;
layout(location = 7) in vec2 a_oldThis;
uniform vec3 u_sizes;   // pixels across: of frames, of the ends of sessions, of arrows (0: dots)
uniform int u_every;
uniform vec4 u_only;
out vec2 v_at;
flat out vec3 v_colour;
flat out float v_size;
void main() {
  vec2 here = a_this * u_unit, before = a_before * u_unit;
  if (u_ease < 1.0) { before = mix(a_oldBefore, before, u_ease); here = mix(a_oldThis, here, u_ease); }
  bool end = (a_flags & 8u) != 0u;
  bool arrow = u_sizes.z > 0.0;
  float size = arrow ? u_sizes.z : end ? u_sizes.y : u_sizes.x;
  vec2 from = pixelsOf(before), to = pixelsOf(here);
  if ((a_flags & 4u) != 0u || size <= 0.0 || a_time > u_until || left(a_session) || any(lessThan(here, u_only.xy)) ||
      any(greaterThan(here, u_only.zw)) || (arrow && ((a_flags & 16u) != 0u || gl_InstanceID % u_every != 0))) {
    gl_Position = kNowhere;
    return;
  }
  vec2 way = to - from;
  float len = length(way);
  vec2 along = arrow && len > 1.0e-4 ? way / len : vec2(1.0, 0.0);
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  v_at = corner * (0.5 * size + 1.0);
  v_size = size;
  v_colour = colourOf(a_session, a_time, a_sd, a_flags);
  vec2 middle = arrow ? 0.5 * (from + to) : to;
  gl_Position = screen(middle + along * v_at.x + vec2(-along.y, along.x) * v_at.y);
}`;

export const dotFragment = `${common}
in vec2 v_at;
flat in vec3 v_colour;
flat in float v_size;
uniform vec3 u_sizes, u_ground;
out vec4 o_colour;
void main() {
  float alpha;
  vec3 colour = v_colour;
  if (u_sizes.z > 0.0) {
    // A triangle that points along.
    float inside = min(0.5 * v_size - abs(v_at.y) * 1.1 - (v_at.x + 0.5 * v_size) * 0.5, v_at.x + 0.5 * v_size);
    alpha = clamp(inside + 0.5, 0.0, 1.0);
  } else {
    float away = length(v_at);
    alpha = clamp(0.5 * v_size + 0.5 - away, 0.0, 1.0);
    if (v_size > 7.0) colour = mix(u_ground, colour, clamp(away - 0.5 * v_size + 3.0, 0.0, 1.0));
  }
  o_colour = vec4(colour * alpha, alpha);
}`;

// Loop closures. What is accepted and beyond doubt lies beneath the lines (u_above 0), all else above them.
export const closureVertex = `${vertexCommon}
layout(location = 0) in vec4 a_ends;     // a, the older one, and b
layout(location = 1) in vec4 a_old;
layout(location = 2) in uvec2 a_state;   // EdgeState, flags
layout(location = 3) in uvec2 a_sessions;
layout(location = 4) in float a_time;
layout(location = 5) in float a_suspicion;
uniform int u_above;
uniform int u_layers;  // a bit for each EdgeState; 32: torn
uniform float u_pixel; // device pixels per CSS pixel
uniform vec3 u_states[5], u_torn, u_suspicious;
out vec2 v_at;
flat out float v_length;
flat out vec3 v_colour;
flat out float v_width;
flat out int v_pattern;  // 0: a line, 1: dashes, 2: dots, 3: a tear
void main() {
  int state = int(min(a_state.x, 4u));
  bool torn = (a_state.y & 2u) != 0u && state == 2 && (u_layers & 32) != 0;
  bool doubtful = a_suspicion >= 0.5 && state == 2;
  bool above = torn || doubtful || state != 2;
  float seen = max(session(a_sessions.x).a, session(a_sessions.y).a);
  if (above != (u_above == 1) || a_time > u_until || seen < 0.5 || (!torn && (u_layers & (1 << state)) == 0)) {
    gl_Position = kNowhere;
    return;
  }
  vec4 ends = u_ease < 1.0 ? mix(a_old, a_ends, u_ease) : a_ends;
  vec2 from = pixelsOf(ends.xy), to = pixelsOf(ends.zw);
  vec2 way = to - from;
  float len = length(way);
  vec2 along = len > 1.0e-4 ? way / len : vec2(1.0, 0.0);
  v_colour = torn ? u_torn : doubtful ? u_suspicious : u_states[state];
  v_pattern = torn ? 3 : state == 1 || state == 3 ? 1 : state == 4 || (a_state.y & 1u) == 0u ? 2 : 0;
  v_width = (torn ? 2.6 : doubtful ? 2.4 : above ? 1.8 : 1.3) * u_pixel;
  float reach = 0.5 * v_width + 1.0 + (torn ? 5.0 * u_pixel : 0.0);
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  v_at = vec2(mix(-reach, len + reach, corner.x), mix(-reach, reach, corner.y));
  v_length = len;
  gl_Position = screen(from + along * v_at.x + vec2(-along.y, along.x) * v_at.y);
}`;

export const closureFragment = `${common}
in vec2 v_at;
flat in float v_length;
flat in vec3 v_colour;
flat in float v_width;
flat in int v_pattern;
uniform float u_pixel;
out vec4 o_colour;
void main() {
  float across = v_at.y;
  float slope = 1.0;
  if (v_pattern == 3) {
    // A zigzag, as paper tears; flat at its ends.
    float step = 9.0 * u_pixel;
    float high = 3.6 * u_pixel * clamp(min(v_at.x, v_length - v_at.x) / step, 0.0, 1.0);
    across -= high * (4.0 * abs(fract(v_at.x / step) - 0.5) - 1.0);
    slope = 0.6;
  }
  float away = length(vec2(v_at.x - clamp(v_at.x, 0.0, v_length), across * slope));
  float alpha = clamp(0.5 * v_width + 0.5 - away, 0.0, 1.0);
  if (v_pattern == 1) alpha *= clamp(4.5 - abs(mod(v_at.x / u_pixel, 11.0) - 4.5), 0.0, 1.0);
  if (v_pattern == 2) alpha *= clamp(2.0 - abs(mod(v_at.x / u_pixel, 6.0) - 2.0), 0.0, 1.0);
  o_colour = vec4(v_colour * alpha, alpha);
}`;
