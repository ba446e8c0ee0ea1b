#include "tools/console/layout/layout_json.h"

#include <nlohmann/json.hpp>

#include "proto/base/reason.h"

namespace relmap::console {
namespace {

using Document = nlohmann::ordered_json;

Document error_json(const Status& status) {
  if (status.ok()) return nullptr;
  return {{"reason", std::string(reason_name(status.reason()))}, {"message", status.message()}};
}

std::string text_of(const Document& document) {
  return document.dump(-1, ' ', false, Document::error_handler_t::replace);
}

Document parts_json(const MapLayout& layout) {
  Document parts = Document::array();
  for (const MapLayout::Part& part : layout.parts)
    parts.push_back({{"root", part.root.to_string()},
                     {"frames", part.frames},
                     {"box", {part.box.low.x(), part.box.low.y(), part.box.high.x(), part.box.high.y()}},
                     {"sessions", part.sessions}});
  return parts;
}

Document torn_json(const MapLayout& layout) {
  Document torn = Document::array();
  for (const client::Tear& tear : layout.torn)
    torn.push_back({{"edge", tear.edge.valid() ? Document(tear.edge.to_string()) : Document(nullptr)},
                    {"a", tear.a.to_string()},
                    {"b", tear.b.to_string()},
                    {"sigmas", tear.sigmas},
                    {"metres", tear.metres}});
  return torn;
}

}  // namespace

std::string json_of(const KeeperState& state) {
  static const MapLayout kNone;
  const MapLayout& layout = state.layout ? *state.layout : kNone;
  Document progress = nullptr;
  if (state.progress)
    progress = {{"step", state.progress->step}, {"done", state.progress->done}, {"total", state.progress->total}};
  return text_of({{"version", layout.version},
                  {"map_version", std::to_string(layout.map_version)},
                  {"map_uuid", layout.map.known() ? layout.map.uuid.to_string() : ""},
                  {"coarse", layout.coarse},
                  {"level", layout.level},
                  {"points", layout.points.size()},
                  {"frames", layout.frames},
                  {"converged", layout.converged},
                  {"seconds", layout.seconds},
                  {"world", {{"x", layout.corner.x()}, {"y", layout.corner.y()}, {"size", layout.size}}},
                  {"zooms", layout.zooms},
                  {"time", {{"first_ms", layout.first_ms}, {"last_ms", layout.last_ms}}},
                  {"parts", parts_json(layout)},
                  {"torn", torn_json(layout)},
                  {"torn_in_all", layout.torn_in_all},
                  {"progress", std::move(progress)},
                  {"behind", state.behind},
                  {"empty", error_json(state.empty)},
                  {"error", error_json(state.error)}});
}

std::string json_of_places(const MapLayout& layout, const std::vector<FrameId>& frames) {
  Document places = Document::array();
  for (const FrameId frame : frames) {
    const auto place = layout.place(frame);
    if (!place) {
      places.push_back(nullptr);
      continue;
    }
    places.push_back({{"frame", frame.to_string()},
                      {"part", layout.runs[place->run].part},
                      {"x", place->position.x()},
                      {"y", place->position.y()},
                      {"heading", place->heading()},
                      {"x_axis", place->x_axis()}});
  }
  return text_of({{"version", layout.version}, {"places", std::move(places)}});
}

Result<std::vector<FrameId>> frames_of_request(std::string_view request, std::size_t most) {
  const auto document = nlohmann::json::parse(request, nullptr, false);
  if (!document.is_object() || !document.contains("frames") || !document["frames"].is_array())
    return {Reason::INVALID_ARGUMENT, R"(the request must be JSON like {"frames": ["6:120"]})"};
  const auto& texts = document["frames"];
  if (texts.size() > most)
    return {Reason::INVALID_ARGUMENT,
            std::to_string(texts.size()) + " frames; at most " + std::to_string(most) + " are told at once"};
  std::vector<FrameId> frames;
  for (const auto& text : texts) {
    const auto frame = text.is_string() ? FrameId::parse(text.get_ref<const std::string&>()) : std::nullopt;
    if (!frame)
      return {Reason::INVALID_ARGUMENT, "a frame is a text like \"6:120\", not " +
                                            text.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace)};
    frames.push_back(*frame);
  }
  return frames;
}

}  // namespace relmap::console
