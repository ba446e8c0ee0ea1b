#include "client/map_legend.h"

#include <utility>

#include "client/colour_scale.h"
#include "client/map_colours.h"
#include "client/map_panel.h"
#include "client/text_wrap.h"
#include "proto/base/number_text.h"

namespace relmap::client {

namespace {

constexpr double kSampleWidth = 30, kTextLeft = 42, kLine = 21, kDetailLine = 18, kEntryGap = 9;
constexpr std::size_t kMaxSessions = 40;  // further sessions are only counted
constexpr std::size_t kTerseFrom = 8;     // from this number of sessions on, each has one line

const TextStyle kPlain{.size = 15, .colour = kInkColour}, kSmall{.size = 13, .colour = kFaintColour};

void no_sample(Drawing&, const Vector2&, const Vector2&) {}

}  // namespace

MapLegend::MapLegend(const MapContents& contents, const Drawing& measure, double width)
    : contents_(contents), measure_(measure), width_(width) {
  add_scale();
  add_sessions();
  add_motion();
  add_closures();
  add_tears();
  const MapPicture& picture = contents.picture();
  if (picture.route)
    add(picture.route->caption.empty() ? "route" : picture.route->caption, "from the ring to the disc",
        [](Drawing& out, const Vector2& a, const Vector2& b) {
          draw_route_piece(out, {a, b});
          draw_route_begin(out, a + Vector2(5, 0));
          draw_route_end(out, b - Vector2(5, 0));
        });
  if (picture.query && contents.find(picture.query->frame))
    add(picture.query->caption.empty() ? "query" : picture.query->caption, "",
        [](Drawing& out, const Vector2& a, const Vector2& b) {
          draw_query(out, 0.7 * a + 0.3 * b, {20, 0});
        });
  for (const MapPicture::Label& label : picture.labels) {
    if (!contents.find(label.frame)) continue;
    add("label", "", [](Drawing& out, const Vector2& a, const Vector2& b) { draw_label_point(out, (a + b) / 2); });
    break;
  }
  if (const std::size_t count = picture.mono_sessions; count > 0)
    add(counted_text(count, "mono session"), "not drawn: photographs have no scale", no_sample);
}

void MapLegend::add(const std::string& text, const std::string& detail, Sample sample) {
  Entry entry{{}, {}, std::move(sample)};
  if (!text.empty() || detail.empty()) entry.text = wrap(measure_, text, kPlain, width_ - kTextLeft);
  if (!detail.empty()) entry.detail = wrap(measure_, detail, kSmall, width_ - kTextLeft);
  height_ += kLine * static_cast<double>(entry.text.size()) + kDetailLine * static_cast<double>(entry.detail.size()) +
             kEntryGap;
  entries_.push_back(std::move(entry));
}

void MapLegend::add_scale() {
  const auto& scale = contents_.picture().scale;
  if (!scale) return;
  add(scale->name, "", no_sample);
  // Colour by colour, from the top down.
  constexpr int kSteps = 5;
  for (int k = 0; k < kSteps; ++k) {
    const double from = static_cast<double>(k) / kSteps, to = static_cast<double>(k + 1) / kSteps;
    const std::string& text = k == 0 ? scale->low : k + 1 == kSteps ? scale->high : std::string();
    add(text, "", [from, to](Drawing& out, const Vector2& a, const Vector2& b) {
      constexpr int kStrips = 8;
      const double tall = (kLine + kEntryGap) / kStrips;
      for (int strip = 0; strip < kStrips; ++strip)
        out.rectangle({a.x(), a.y() - 15 + strip * tall}, {b.x() - a.x(), tall + 0.5},
                      paper_scale(from + (to - from) * (strip + 0.5) / kStrips), 1);
    });
  }
}

void MapLegend::add_tears() {
  const MapPicture& picture = contents_.picture();
  if (!picture.tears.empty())
    add(counted_text(picture.tears.size(), "tear"),
        "here the measured edges contradict each other: by how many standard deviations the picture stretches one",
        [](Drawing& out, const Vector2& a, const Vector2& b) { draw_tear(out, a, b); });
  if (picture.strained.empty()) return;
  add("closures that the picture stretches most", "", no_sample);
  for (const std::string& line : picture.strained) add("", line, no_sample);
}

void MapLegend::add_sessions() {
  const auto& sessions = contents_.sessions();
  const bool single = sessions.size() == 1;
  if (sessions.size() >= kTerseFrom) add("session (keyframes)", "", no_sample);
  std::size_t shown = 0;
  for (const auto& [session, frames] : sessions) {
    if (++shown > kMaxSessions) {
      add("and " + counted_text(sessions.size() - kMaxSessions, "more session"), "", no_sample);
      break;
    }
    const Colour full = contents_.colour(session), first = contents_.shade(frames.front());
    const bool scaled = contents_.picture().scale.has_value();
    const auto line = [full, first, scaled](Drawing& out, const Vector2& a, const Vector2& b) {
      if (scaled) return;
      for (int k = 0; k < 10; ++k)
        out.line(a + (b - a) * (k / 10.0), a + (b - a) * ((k + 1) / 10.0),
                 motion_stroke(MapPicture::EdgeKind::kMotion, mix(first, full, k / 9.0)));
    };
    if (sessions.size() >= kTerseFrom)
      add(contents_.name(session) + " (" + count_text(contents_.keyframes(session)) + ")", "", line);
    else
      add(contents_.name(session),
          counted_text(contents_.keyframes(session), "keyframe") +
              (single && !scaled && frames.size() > 1 ? ", light to dark in time" : ""),
          line);
  }
  bool marked = false;
  for (std::size_t part = 0; part < contents_.picture().parts.size(); ++part)
    marked = marked || contents_.marks_sessions(part);
  if (!marked) return;
  const Colour first = contents_.colour(sessions.begin()->first);
  add("start and end", "", [first](Drawing& out, const Vector2& a, const Vector2& b) {
    draw_start(out, a + Vector2(5, 0), first);
    draw_end(out, b - Vector2(5, 0), first);
  });
}

void MapLegend::add_motion() {
  const Colour first =
      contents_.sessions().empty() ? kInkColour : contents_.colour(contents_.sessions().begin()->first);
  const struct {
    MapPicture::EdgeKind kind;
    const char *name, *meaning;
  } kinds[] = {{MapPicture::EdgeKind::kUnmeasuredMotion, "unmeasured step", "dashes: nothing measured this motion"},
               {MapPicture::EdgeKind::kCarriedMotion, "carried step", "dots: closures say that the robot was carried"}};
  for (const auto& [kind, name, meaning] : kinds)
    if (const std::size_t count = contents_.count(kind); count > 0)
      add(counted_text(count, name), meaning, [kind = kind, first](Drawing& out, const Vector2& a, const Vector2& b) {
        out.line(a, b, motion_stroke(kind, first));
        out.disc(a, 2.6, first, 0, kWhiteColour);
        out.disc(b, 2.6, first, 0, kWhiteColour);
      });
  if (const std::size_t count = contents_.count_between_parts(MapPicture::EdgeKind::kUnmeasuredMotion); count > 0)
    add(counted_text(count, "step") + " from part to part", "not drawn: nothing measured the motion", no_sample);
}

void MapLegend::add_closures() {
  const std::vector<ClosureStyle>& styles = closure_styles();
  for (auto style = styles.rbegin(); style != styles.rend(); ++style) {
    if (const std::size_t count = contents_.count(style->kind); count > 0) {
      const auto behind = contents_.picture().alike.find(style->kind);
      const std::size_t alike = behind == contents_.picture().alike.end() ? 0 : behind->second;
      std::string meaning = style->meaning;
      if (alike > 0)
        meaning +=
            (meaning.empty() ? "" : "; ") + count_text(count) + " drawn: of those that join the same stretches one";
      add(counted_text(count + alike, style->name), meaning,
          [s = *style](Drawing& out, const Vector2& a, const Vector2& b) { draw_closure(out, s, a, b); });
    }
    if (const std::size_t count = contents_.count_between_parts(style->kind); count > 0)
      add(counted_text(count, style->name) + " from part to part", "not drawn; " + std::string(style->meaning),
          no_sample);
  }
}

void MapLegend::draw(Drawing& out, const Vector2& corner) const {
  double y = corner.y() + 8;
  for (const Entry& entry : entries_) {
    entry.sample(out, {corner.x(), y + 4}, {corner.x() + kSampleWidth, y + 4});
    for (const std::string& line : entry.text) {
      out.text({corner.x() + kTextLeft, y + 9}, line, kPlain);
      y += kLine;
    }
    for (const std::string& line : entry.detail) {
      out.text({corner.x() + kTextLeft, y + 6}, line, kSmall);
      y += kDetailLine;
    }
    y += kEntryGap;
  }
}

}  // namespace relmap::client
