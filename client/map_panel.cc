#include "client/map_panel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <set>
#include <span>

#include "client/map_colours.h"
#include "client/text_wrap.h"
#include "proto/base/number_text.h"

namespace relmap::client {

namespace {

constexpr Colour kGrid{233, 233, 228}, kBorder{214, 214, 208};
constexpr double kNarrow = 420;             // points; narrower panels have smaller margins and letters
constexpr std::size_t kNamedSessions = 12;  // if there are more, they are labelled with their numbers
constexpr std::size_t kNamedTears = 10;     // further ones are marked only
constexpr std::ptrdiff_t kCrowd = 2000;     // closures; of more, the ends are not marked

double inset_of(double width) { return width < kNarrow ? 22 : 34; }

std::vector<Vector3> positions(const MapContents& contents, std::size_t part) {
  const MapPicture& picture = contents.picture();
  std::vector<Vector3> out;
  for (const MapPicture::Frame& frame : picture.parts[part].frames) out.push_back(frame.T_root_frame.t);
  if (!picture.query) return out;
  const auto* beside = contents.find(picture.query->frame);
  if (beside && beside->part == part) out.push_back((*beside->T_root_frame * picture.query->T_frame_query).t);
  return out;
}

// The largest of 1, 2, 5 times a power of ten that is at most `limit`.
double round_length(double limit) {
  const double power = std::pow(10, std::floor(std::log10(limit)));
  for (const double factor : {5.0, 2.0})
    if (factor * power <= limit) return factor * power;
  return power;
}

std::string length_name(double metres) {
  char text[32];
  if (metres >= 1000)
    std::snprintf(text, sizeof text, "%g km", metres / 1000);
  else if (metres < 1)
    std::snprintf(text, sizeof text, "%g cm", metres * 100);
  else
    std::snprintf(text, sizeof text, "%g m", metres);
  return text;
}

// Without the points that lie so near to the one before that nobody sees the difference. A drive of 100 km has
// hundreds of thousands of points, several on each point of the page.
std::vector<Vector2> thinned(std::span<const Vector2> points) {
  constexpr double kSeen = 0.3;
  std::vector<Vector2> kept;
  for (std::size_t k = 0; k < points.size(); ++k)
    if (kept.empty() || k + 1 == points.size() || (points[k] - kept.back()).norm() >= kSeen) kept.push_back(points[k]);
  return kept;
}

}  // namespace

Stroke motion_stroke(MapPicture::EdgeKind kind, Colour colour) {
  switch (kind) {
    case MapPicture::EdgeKind::kUnmeasuredMotion:
      return {colour, 2, 1, 6};
    case MapPicture::EdgeKind::kCarriedMotion:
      return {colour, 3, 1, 2.5};
    default:
      return {colour, 3, 1, 0};
  }
}

const std::vector<ClosureStyle>& closure_styles() {
  static const std::vector<ClosureStyle> styles{
      {MapPicture::EdgeKind::kLoopRemoved,
       "removed closure",
       "taken out by an operator",
       {kNotInForceColour, 1.4, 1, 2},
       true},
      {MapPicture::EdgeKind::kLoopQuarantined,
       "quarantined closure",
       "outvoted: not in force",
       {kQueryColour, 1.4, 1, 3.5},
       true},
      {MapPicture::EdgeKind::kLoopCandidate,
       "candidate closure",
       "not in force: nothing agrees, or motion contradicts",
       {kNotInForceColour, 1.6, 1, 7},
       false},
      {MapPicture::EdgeKind::kLoopAccepted, "loop closure", "", {kLoopColour, 2.4, 1, 0}, false}};
  return styles;
}

void draw_closure(Drawing& out, const ClosureStyle& style, const Vector2& from, const Vector2& to) {
  out.line(from, to, style.stroke);
  for (const Vector2& end : {from, to}) {
    if (style.hollow)
      out.disc(end, 2.8, kWhiteColour, 1.4, style.stroke.colour);
    else
      out.disc(end, 3.2, style.stroke.colour, 0, kWhiteColour);
  }
}

void draw_start(Drawing& out, const Vector2& at, Colour colour) { out.disc(at, 6.5, kWhiteColour, 3, colour); }
void draw_end(Drawing& out, const Vector2& at, Colour colour) { out.disc(at, 7.5, colour, 2, kWhiteColour); }

void draw_arrow(Drawing& out, const Vector2& at, const Vector2& direction, Colour colour) {
  const Vector2 along = direction.normalized() * 6.5, side(-along.y() * 0.75, along.x() * 0.75);
  out.polygon({at + along, at - along + side, at - 0.5 * along, at - along - side}, mix(colour, kInkColour, 0.25), 1);
}

void draw_tear(Drawing& out, const Vector2& from, const Vector2& to) {
  const Vector2 middle = (from + to) / 2;
  const Vector2 along = (to - from).norm() > 1 ? Vector2((to - from).normalized()) : Vector2(1, 0);
  const Vector2 side = 6.5 * Vector2(-along.y(), along.x()), gap = 3.2 * along, slant = 2 * along;
  if ((to - from).norm() > 14) {
    out.line(from, middle - gap, {kQueryColour, 2.2, 1, 0});
    out.line(middle + gap, to, {kQueryColour, 2.2, 1, 0});
  }
  out.polygon({middle - gap - side - slant, middle + gap - side - slant, middle + gap + side + slant,
               middle - gap + side + slant},
              kWhiteColour, 1);
  for (const Vector2& edge : {Vector2(middle - gap), Vector2(middle + gap)})
    out.line(edge - side - slant, edge + side + slant, {kQueryColour, 2.4, 1, 0});
}

void draw_label_point(Drawing& out, const Vector2& at) { out.disc(at, 5, kInkColour, 2, kWhiteColour); }

void draw_route_piece(Drawing& out, const std::vector<Vector2>& way) { out.polyline(way, {kRouteColour, 13, 0.75, 0}); }

void draw_route_begin(Drawing& out, const Vector2& at) { out.disc(at, 10, kWhiteColour, 4, kRouteColour); }
void draw_route_end(Drawing& out, const Vector2& at) { out.disc(at, 10, kRouteColour, 0, kRouteColour); }

void draw_query(Drawing& out, const Vector2& at, const Vector2& view) {
  const Vector2 side(-view.y(), view.x());
  out.polygon({at, at + view + 0.45 * side, at + view - 0.45 * side}, kQueryColour, 0.3);
  out.disc(at, 8, kQueryColour, 3, kWhiteColour);
}

// Draws a panel into an area.
class MapPanel::Pen {
 public:
  Pen(const MapPanel& panel, Drawing& out, const Box& area)
      : panel_(panel),
        contents_(panel.contents_),
        picture_(contents_.picture()),
        out_(out),
        area_(area),
        shift_(area.low + Vector2(panel.inset_, (area.size().y() - panel.plan_.height()) / 2)),
        narrow_(area.size().x() < kNarrow),
        placement_(Box{area.low + Vector2(4, 4), area.high - Vector2(4, 4)}) {
    for (const auto& [session, frames] : contents_.sessions())
      for (const FrameId frame : frames)
        if (contents_.find(frame)->part == panel.part_) frames_[session].push_back(frame);
  }

  void draw() {
    grid();
    if (picture_.route) route();
    for (const auto& [session, frames] : frames_) trajectory(frames);
    closures();
    if (marks_sessions())
      for (const auto& [session, frames] : frames_) ends(session, frames);
    tears();
    texts();
    Vector2 at;
    if (picture_.query && find_query(at)) draw_query(out_, at, 36 * panel_.plan_.heading(query_pose()));
  }

 private:
  // Sets `at` to the position of a frame on the page; false if the frame is not in this part.
  bool find(FrameId frame, Vector2& at) const {
    const auto* place = contents_.find(frame);
    if (!place || place->part != panel_.part_) return false;
    at = shift_ + panel_.plan_.at(place->T_root_frame->t);
    return true;
  }
  Vector2 at(FrameId frame) const {
    Vector2 found = Vector2::Zero();
    find(frame, found);
    return found;
  }
  SE3 query_pose() const {
    return *contents_.find(picture_.query->frame)->T_root_frame * picture_.query->T_frame_query;
  }
  bool find_query(Vector2& at) const {
    if (!find(picture_.query->frame, at)) return false;
    at = shift_ + panel_.plan_.at(query_pose().t);
    return true;
  }

  void grid() {
    out_.rectangle(area_.low, area_.size(), kWhiteColour, 1);
    const double max_length = std::min(170.0, 0.45 * area_.size().x());
    const double bar = round_length(max_length / panel_.plan_.points_per_metre());
    const double step = bar * panel_.plan_.points_per_metre();
    const Vector2 middle = (area_.low + area_.high) / 2;
    const Stroke thin{kGrid, 1, 1, 0};
    for (int k = -100; k <= 100; ++k) {
      const double x = middle.x() + k * step, y = middle.y() + k * step;
      if (x > area_.low.x() && x < area_.high.x()) out_.line({x, area_.low.y()}, {x, area_.high.y()}, thin);
      if (y > area_.low.y() && y < area_.high.y()) out_.line({area_.low.x(), y}, {area_.high.x(), y}, thin);
    }
    out_.polyline({area_.low, {area_.high.x(), area_.low.y()}, area_.high, {area_.low.x(), area_.high.y()}, area_.low},
                  {kBorder, 1, 1, 0});
    const double y = area_.high.y() + 20, x = area_.low.x() + 2;
    out_.polyline({{x, y - 5}, {x, y}, {x + step, y}, {x + step, y - 5}}, {kInkColour, 2, 1, 0});
    const TextStyle plain{.size = 15, .colour = kInkColour},
        small{.size = 13, .colour = kFaintColour, .anchor = Anchor::kRight};
    out_.text({x + step + 10, y + 3}, length_name(bar), plain);
    const std::string note = "seen from above, grid " + length_name(bar);
    if (x + step + 20 + out_.text_width(length_name(bar), plain) + out_.text_width(note, small) < area_.high.x())
      out_.text({area_.high.x(), y + 3}, note, small);
  }

  void route() {
    std::vector<Vector2> way;
    const auto end_piece = [&] {
      if (way.size() > 1) draw_route_piece(out_, way);
      way.clear();
    };
    Vector2 at;
    for (const FrameId frame : picture_.route->frames) {
      if (!find(frame, at)) {
        end_piece();
        continue;
      }
      way.push_back(at);
    }
    end_piece();
    if (picture_.route->frames.empty()) return;
    if (find(picture_.route->frames.front(), at)) draw_route_begin(out_, at);
    if (find(picture_.route->frames.back(), at)) draw_route_end(out_, at);
  }

  // Draws each run of frames that measured motion joins, and the other motion between the runs.
  void trajectory(const std::vector<FrameId>& frames) {
    std::vector<std::vector<FrameId>> runs;
    std::vector<std::pair<FrameId, MapPicture::EdgeKind>> bridges;  // to this frame from the one before it
    for (std::size_t k = 0; k < frames.size(); ++k) {
      const MapPicture::Edge* step = contents_.step(frames[k]);
      if (step && (k == 0 || std::min(step->a, step->b) != frames[k - 1])) step = nullptr;
      if (step && step->kind != MapPicture::EdgeKind::kMotion) bridges.emplace_back(frames[k], step->kind);
      if (!step || step->kind != MapPicture::EdgeKind::kMotion) runs.emplace_back();
      runs.back().push_back(frames[k]);
      if (!step) {
        placement_.avoid(at(frames[k]));
        continue;
      }
      const Vector2 from = at(frames[k - 1]), to = at(frames[k]);
      for (double t = 0.25; t <= 1; t += 0.25) placement_.avoid(from + t * (to - from));
    }
    for (const auto& [frame, kind] : bridges) {
      const Vector2 from = at(std::min(contents_.step(frame)->a, contents_.step(frame)->b)), to = at(frame);
      Stroke stroke = motion_stroke(kind, contents_.shade(frame));
      stroke.dash = std::clamp((to - from).norm() / 3, 1.5, stroke.dash);  // so that a short step is dashed, too
      out_.line(from, to, stroke);
    }
    for (const std::vector<FrameId>& run : runs) draw_run(run, frames.size());
  }

  void draw_run(const std::vector<FrameId>& run, std::size_t of) {
    std::vector<Vector2> points;
    for (const FrameId frame : run) points.push_back(at(frame));
    if (run.size() == 1) {
      out_.disc(points[0], 2.6, contents_.shade(run[0]), 0, kWhiteColour);
      return;
    }
    constexpr std::size_t kShades = 48;  // number of pieces of different shade, which show time
    const std::size_t piece = std::max<std::size_t>(1, of / kShades);
    out_.polyline(thinned(points), {kWhiteColour, 4.8, 0.85, 0});
    for (std::size_t k = 0; k + 1 < run.size(); k += piece) {
      const std::size_t end = std::min(k + piece, run.size() - 1);
      out_.polyline(thinned(std::span(points).subspan(k, end - k + 1)),
                    motion_stroke(MapPicture::EdgeKind::kMotion, contents_.shade(run[k])));
    }
    if (!marks_sessions()) return;  // so many arrows would hide the ways
    double travelled = 60;
    for (std::size_t k = 1; k < run.size(); ++k) {
      const Vector2 step = points[k] - points[k - 1];
      travelled += step.norm();
      if (travelled < 130 || step.norm() < 1e-6) continue;
      travelled = 0;
      draw_arrow(out_, points[k], step, contents_.shade(run[k]));
    }
  }

  void closures() {
    Vector2 a, b;
    for (ClosureStyle style : closure_styles()) {
      // Hundreds of closures of full width would hide the route, and thousands all that was driven.
      const bool crowded = std::ranges::count_if(picture_.edges, [&](const MapPicture::Edge& edge) {
                             return edge.kind == style.kind && find(edge.a, a) && find(edge.b, b);
                           }) > kCrowd;
      if (picture_.route || crowded) style.stroke.width *= 0.4;
      std::set<std::array<std::int64_t, 4>> drawn;  // the points of the page that closures of this style join already
      for (const MapPicture::Edge& edge : picture_.edges) {
        if (edge.kind != style.kind || !find(edge.a, a) || !find(edge.b, b)) continue;
        if (!drawn.insert({std::llround(a.x()), std::llround(a.y()), std::llround(b.x()), std::llround(b.y())}).second)
          continue;
        if (crowded)
          out_.line(a, b, style.stroke);
        else
          draw_closure(out_, style, a, b);
      }
    }
  }

  void tears() {
    Vector2 a, b;
    for (const MapPicture::Tear& tear : picture_.tears)
      if (find(tear.a, a) && find(tear.b, b)) draw_tear(out_, a, b);
  }

  bool marks_sessions() const { return contents_.marks_sessions(panel_.part_); }
  // Draws where the session began and ended, if that is in this part.
  void ends(SessionNumber session, const std::vector<FrameId>& frames) {
    const std::vector<FrameId>& all = contents_.sessions().at(session);
    const Colour ink = contents_.colour(session);
    if (frames.front() == all.front()) draw_start(out_, at(frames.front()), ink);
    if (frames.back() == all.back() && all.size() > 1) draw_end(out_, at(frames.back()), ink);
  }

  void texts() {
    Vector2 at;
    if (picture_.query && find_query(at)) placement_.avoid(Box{at - Vector2(22, 22), at + Vector2(22, 22)});
    for (const auto& [session, frames] : frames_)
      for (const FrameId end : {frames.front(), frames.back()}) {
        if (!marks_sessions()) break;
        const Vector2 mark = this->at(end);
        placement_.avoid(Box{mark - Vector2(8, 8), mark + Vector2(8, 8)});
      }
    const TextStyle label_style{.size = narrow_ ? 14.0 : 17.0, .colour = kInkColour, .bold = true, .halo = 2};
    for (const MapPicture::Label& label : picture_.labels) {
      if (!find(label.frame, at)) continue;
      leader(at, label.text, label_style);
      draw_label_point(out_, at);
    }
    Vector2 b;
    std::size_t named = 0;
    for (const MapPicture::Tear& tear : picture_.tears) {
      if (!find(tear.a, at) || !find(tear.b, b) || ++named > kNamedTears) continue;
      leader((at + b) / 2, fixed(tear.sigmas, 1) + " sigmas",
             {.size = narrow_ ? 13.0 : 15.0, .colour = kQueryColour, .bold = true, .halo = 2});
    }
    if (!marks_sessions()) return;
    const std::size_t sessions = contents_.sessions().size();
    for (const auto& [session, frames] : frames_) {
      const TextStyle style{
          .size = narrow_ ? 12.0 : 14.0, .colour = mix(contents_.colour(session), kInkColour, 0.4), .halo = 2};
      const Vector2 first = this->at(frames.front());
      if (sessions > 1) {
        leader(first, sessions > kNamedSessions ? std::to_string(session) : contents_.name(session), style);
        continue;
      }
      const std::vector<FrameId>& all = contents_.sessions().at(session);
      if (frames.front() == all.front()) leader(first, "start", style);
      if (frames.back() == all.back() && all.size() > 1) leader(this->at(frames.back()), "end", style);
    }
  }

  // Draws a text near `at`, with a line between them if they are far apart.
  void leader(const Vector2& at, const std::string& text, const TextStyle& style) {
    const double line_height = 1.25 * style.size;
    const std::vector<std::string> lines = wrap(out_, text, style, std::min(260.0, 0.7 * area_.size().x()));
    Vector2 size(0, style.size + line_height * static_cast<double>(lines.size() - 1));
    for (const std::string& line : lines) size.x() = std::max(size.x(), out_.text_width(line, style));
    const Box box = placement_.place(at, size);
    const Vector2 near = at.cwiseMax(box.low - Vector2(3, 1)).cwiseMin(box.high + Vector2(3, 1));
    if ((near - at).norm() > 12) out_.line(at, near, {style.colour, 1.2, 0.8, 0});
    for (std::size_t i = 0; i < lines.size(); ++i)
      out_.text({box.low.x(), box.low.y() + 0.86 * style.size + line_height * static_cast<double>(i)}, lines[i], style);
  }

  const MapPanel& panel_;
  const MapContents& contents_;
  const MapPicture& picture_;
  Drawing& out_;
  const Box area_;
  const Vector2 shift_;
  const bool narrow_;
  LabelPlacement placement_;
  std::map<SessionNumber, std::vector<FrameId>> frames_;  // in this part, ascending
};

MapPanel::MapPanel(const MapContents& contents, std::size_t part, double width, double max_height)
    : contents_(contents),
      part_(part),
      inset_(inset_of(width)),
      plan_(positions(contents, part), width - 2 * inset_, max_height, contents.picture().turn_to_fit) {}

void MapPanel::draw(Drawing& out, const Box& area) const { Pen(*this, out, area).draw(); }

}  // namespace relmap::client
