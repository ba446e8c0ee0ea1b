// Where was this seen, and which places could it be?
#include <cmath>
#include <memory>

#include "tools/relmap/commands.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

struct Seen {
  std::string left, right, near;
  std::uint32_t max_places = 0;
  ViewOptions camera;
};

void print(const client::Localisation& found, Console& console) {
  const Vector6 sigma = found.covariance.diagonal().cwiseSqrt();
  console.facts(
      {{"frame", found.frame.to_string()},
       {"position in it", vector_text(found.T_frame_view.t) + " m, sigmas " + vector_text(sigma.head<3>())},
       {"rotation in it", vector_text(so3_log(found.T_frame_view.R)) + " rad, sigmas " + vector_text(sigma.tail<3>())},
       {"inliers", std::to_string(found.inliers) + " (" + name_of(found.verification) + "), over " +
                       fixed(100 * found.spread, 0) + " % of the picture"},
       {"probability", fixed(found.probability, 4) + " by appearance; a new place " + fixed(found.new_place, 4)}});
}

void print(const client::PlaceMatches& matches, Console& console) {
  std::vector<std::vector<std::string>> rows;
  for (const client::PlaceMatch& place : matches.places)
    rows.push_back({place.frame.to_string(), fixed(place.probability, 4), name_of(place.verification),
                    std::to_string(place.inliers)});
  rows.push_back({"a new place", fixed(matches.new_place, 4), "", ""});
  console.table({"place", ">probability", "verified by", ">inliers"}, rows);
}

}  // namespace

void add_localise(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("localise", "where a picture, or a stereo pair, was taken");
  auto seen = std::make_shared<Seen>();
  command->add_option("LEFT", seen->left, "JPEG or PNG")->required();
  command->add_option("RIGHT", seen->right, "the right eye's picture");
  command->add_option("--near", seen->near, "a frame somewhere near, tried first");
  add_view_options(*command, seen->camera);
  command->callback([&action, seen] {
    action = [seen](client::Client& client, Console& console) -> Status {
      std::optional<FrameId> prior;
      if (!seen->near.empty()) {
        const auto frame = parse_frame(seen->near);
        if (!frame.ok()) return frame.status();
        prior = *frame;
      }
      const auto view = make_view(client, console, seen->left, seen->right, seen->camera, true);
      if (!view.ok()) return view.status();
      const auto found = client.localise(*view, prior);
      if (!found.ok()) return found.status();
      if (!console.json) print(*found, console);
      return {};
    };
  });
}

void add_match(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("match", "which places of the map a picture could show");
  auto seen = std::make_shared<Seen>();
  command->add_option("PICTURE", seen->left, "JPEG or PNG")->required();
  command->add_option("--max", seen->max_places, "places, at most (20)");
  add_view_options(*command, seen->camera);
  command->callback([&action, seen] {
    action = [seen](client::Client& client, Console& console) -> Status {
      const auto view = make_view(client, console, seen->left, "", seen->camera, false);
      if (!view.ok()) return view.status();
      const auto matches = client.match_image(*view, seen->max_places);
      if (!matches.ok()) return matches.status();
      if (!console.json) print(*matches, console);
      return {};
    };
  });
}

}  // namespace relmap::cli
