#include "client/map_legend.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/colour_scale.h"
#include "client/map_colours.h"
#include "client/map_panel.h"
#include "client/text_wrap.h"
#include "proto/base/number_text.h"

namespace relmap::client {

namespace {

constexpr double kSampleWidth = 30, kTextLeft = 42, kLine = 21, kDetailLine = 18, kEntryGap = 9, kTerseGap = 2;
constexpr double kScaleHeight = 150;      // at least, of the bar of colours
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

MapLegend::Entry& MapLegend::add(const std::string& text, const std::string& detail, Sample sample) {
  Entry entry;
  entry.sample = std::move(sample);
  if (!text.empty() || detail.empty()) entry.text = wrap(measure_, text, kPlain, width_ - kTextLeft);
  if (!detail.empty()) entry.detail = wrap(measure_, detail, kSmall, width_ - kTextLeft);
  entry.height = kLine * static_cast<double>(entry.text.size()) +
                 kDetailLine * static_cast<double>(entry.detail.size()) + kEntryGap;
  entries_.push_back(std::move(entry));
  return entries_.back();
}

void MapLegend::add_scale() {
  const auto& scale = contents_.picture().scale;
  if (!scale) return;
  Entry& name = add(scale->name, "", no_sample);
  if (!scale->low.empty() || !scale->high.empty()) {
    name.heading = true;
    // One bar from the top down, what its ends stand for beside them.
    const std::vector<std::string> low = wrap(measure_, scale->low, kPlain, width_ - kTextLeft),
                                   high = wrap(measure_, scale->high, kPlain, width_ - kTextLeft);
    const double tall = std::max(kScaleHeight, kLine * static_cast<double>(low.size() + high.size() + 1));
    const auto draw_scale = [low, high, tall](Drawing& out, const Vector2& a, const Vector2& b) {
      constexpr int kStrips = 50;
      const double top = a.y() - 4, strip = tall / kStrips;
      for (int k = 0; k < kStrips; ++k)  // each reaches below the next one, so that no seam shows
        out.rectangle({a.x(), top + k * strip}, {b.x() - a.x(), tall - k * strip}, paper_scale((k + 0.5) / kStrips), 1);
      const double left = a.x() + kTextLeft;
      for (std::size_t i = 0; i < low.size(); ++i)
        out.text({left, top + 12 + kLine * static_cast<double>(i)}, low[i], kPlain);
      for (std::size_t i = 0; i < high.size(); ++i)
        out.text({left, top + tall - 1 - kLine * static_cast<double>(high.size() - 1 - i)}, high[i], kPlain);
    };
    Entry bar;
    bar.sample = draw_scale;
    bar.height = tall + 2 * kEntryGap;
    entries_.push_back(std::move(bar));
  }
  const auto unknown = [](const MapPicture::Frame& frame) { return !std::isfinite(frame.value); };
  const auto& parts = contents_.picture().parts;
  if (std::ranges::any_of(parts,
                          [&](const MapPicture::Part& part) { return std::ranges::any_of(part.frames, unknown); }))
    add("not known", "", [](Drawing& out, const Vector2& a, const Vector2& b) {
      out.line(a, b, motion_stroke(MapPicture::EdgeKind::kMotion, kNotInForceColour));
    });
}

void MapLegend::add_tears() {
  const MapPicture& picture = contents_.picture();
  if (!picture.tears.empty())
    add(counted_text(picture.tears.size(), "tear"),
        "here the measured edges contradict each other: by how many standard deviations the picture stretches one",
        [](Drawing& out, const Vector2& a, const Vector2& b) { draw_tear(out, a, b); });
  if (picture.strained.empty()) return;
  add("closures that the picture stretches most", "", no_sample).heading = true;
  for (const std::string& line : picture.strained) add("", line, no_sample);
}

void MapLegend::add_sessions() {
  const auto& sessions = contents_.sessions();
  // On a scale, no colour is that of a session.
  if (!contents_.picture().scale) add_names();
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

void MapLegend::add_names() {
  const auto& sessions = contents_.sessions();
  const bool single = sessions.size() == 1, terse = sessions.size() >= kTerseFrom;
  if (terse) add("session (keyframes)", "", no_sample).heading = true;
  std::size_t shown = 0;
  for (const auto& [session, frames] : sessions) {
    if (++shown > kMaxSessions) {
      add("and " + counted_text(sessions.size() - kMaxSessions, "more session"), "", no_sample);
      return;
    }
    const Colour full = contents_.colour(session), first = contents_.shade(frames.front());
    const auto line = [full, first](Drawing& out, const Vector2& a, const Vector2& b) {
      for (int k = 0; k < 10; ++k)
        out.line(a + (b - a) * (k / 10.0), a + (b - a) * ((k + 1) / 10.0),
                 motion_stroke(MapPicture::EdgeKind::kMotion, mix(first, full, k / 9.0)));
    };
    if (terse)
      add(contents_.name(session) + " (" + count_text(contents_.keyframes(session)) + ")", "", line).height +=
          kTerseGap - kEntryGap;
    else
      add(contents_.name(session),
          counted_text(contents_.keyframes(session), "keyframe") +
              (single && frames.size() > 1 ? ", light to dark in time" : ""),
          line);
  }
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

std::vector<std::size_t> MapLegend::breaks(double height) const {
  std::vector<std::size_t> found;
  double filled = 0;
  for (std::size_t i = 0; i < entries_.size();) {
    std::size_t end = i + 1;  // of what stays together
    while (end < entries_.size() && entries_[end - 1].heading) ++end;
    double block = 0;
    for (std::size_t k = i; k < end; ++k) block += entries_[k].height;
    if (filled > 0 && filled + block > height + 1e-6) {
      found.push_back(i);
      filled = 0;
    }
    filled += block;
    i = end;
  }
  return found;
}

double MapLegend::height(std::size_t columns) const {
  double all = 0;
  for (const Entry& entry : entries_) all += entry.height;
  // The columns end where entries do, so that the least height has to be looked for.
  double height = all / static_cast<double>(std::max<std::size_t>(columns, 1));
  while (height < all && breaks(height).size() + 1 > columns) height += kTerseGap;
  // A block of a heading and its entry may be higher than an even share.
  double highest = 0, filled = 0;
  const std::vector<std::size_t> begins = breaks(height);
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (std::ranges::find(begins, i) != begins.end()) filled = 0;
    filled += entries_[i].height;
    highest = std::max(highest, filled);
  }
  return highest;
}

void MapLegend::draw(Drawing& out, const Vector2& corner, std::size_t columns, double apart) const {
  const std::vector<std::size_t> begins = breaks(height(columns));
  Vector2 at = corner + Vector2(0, 8);
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (std::ranges::find(begins, i) != begins.end()) at = {at.x() + apart, corner.y() + 8};
    const Entry& entry = entries_[i];
    entry.sample(out, {at.x(), at.y() + 4}, {at.x() + kSampleWidth, at.y() + 4});
    double y = at.y();
    for (const std::string& line : entry.text) {
      out.text({at.x() + kTextLeft, y + 9}, line, kPlain);
      y += kLine;
    }
    for (const std::string& line : entry.detail) {
      out.text({at.x() + kTextLeft, y + 6}, line, kSmall);
      y += kDetailLine;
    }
    at.y() += entry.height;
  }
}

}  // namespace relmap::client
