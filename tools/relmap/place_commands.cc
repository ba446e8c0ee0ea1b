// Where was this seen, and which places could it be?
#include <cmath>
#include <memory>
#include <optional>
#include <ostream>

#include "proto/base/json.h"
#include "tools/relmap/commands.h"
#include "tools/relmap/picture_file.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

struct Seen {
  std::string left, right, near;
  client::MatchOptions match;
  std::string thumbnails;  // folder
  ViewOptions camera;
};

Result<std::optional<FrameId>> near_frame(const Seen& seen) {
  if (seen.near.empty()) return std::optional<FrameId>();
  const auto frame = parse_frame(seen.near);
  if (!frame.ok()) return frame.status();
  return std::optional(*frame);
}

std::string focal_length_text(const std::optional<double>& estimated) {
  return estimated ? "; focal length estimated as " + fixed(*estimated, 0) + " px" : "";
}

void print(const client::Localisation& found, terminal::Console& console) {
  const Vector6 sigma = found.covariance.diagonal().cwiseSqrt();
  console.facts({{"frame", found.frame.to_string()},
                 {"position in it",
                  terminal::vector_text(found.T_frame_view.t) + " m, sigmas " + terminal::vector_text(sigma.head<3>())},
                 {"rotation in it", terminal::vector_text(so3_log(found.T_frame_view.R)) + " rad, sigmas " +
                                        terminal::vector_text(sigma.tail<3>())},
                 {"inliers", std::to_string(found.inliers) + " (" + name_of(found.verification) + "), over " +
                                 fixed(100 * found.spread, 0) + " % of the picture" +
                                 focal_length_text(found.estimated_focal_length)},
                 {"probability", found.near_prior ? std::string("not asked for: it is near the frame that was named")
                                                  : fixed(found.probability, 4) + " by appearance; a new place " +
                                                        fixed(found.new_place, 4)}});
}

void print(const client::PlaceMatches& matches, terminal::Console& console) {
  std::vector<std::vector<std::string>> rows;
  for (const client::PlaceMatch& place : matches.places) {
    const bool verified = place.verification != client::Verification::kNone;
    rows.push_back({place.frame.to_string(), fixed(place.probability, 4), verified ? name_of(place.verification) : "",
                    verified ? std::to_string(place.inliers) : "",
                    verified ? "" : std::string(reason_name(place.unverified.reason()))});
  }
  rows.push_back({"a new place", fixed(matches.new_place, 4), "", "", ""});
  console.table({"place", ">probability", "verified by", ">inliers", "not verified"}, rows);
  if (!matches.nothing_verified.ok())
    console.err() << "geometry confirms none of them: " << matches.nothing_verified.to_string() << '\n';
}

Status localise(const Seen& seen, client::Client& client, terminal::Console& console) {
  const auto prior = near_frame(seen);
  if (!prior.ok()) return prior.status();
  const auto view = make_view(client, console, seen.left, seen.right, seen.camera);
  if (!view.ok()) return view.status();
  const auto found = client.localise(*view, *prior);
  if (!found.ok()) return found.status();
  if (!console.json) print(*found, console);
  return {};
}

// That a picture shows no place of the map is an answer, too.
std::string refusal_json(const Status& status) {
  return Json()
      .add("error", Json().add("reason", reason_name(status.reason())).add("message", status.message()))
      .text();
}

}  // namespace

void add_localise(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("localise", "where a picture, or a stereo pair, was taken");
  auto seen = std::make_shared<Seen>();
  command->add_option("LEFT", seen->left, "JPEG or PNG of any camera; or a frame of the map, as 3:120")->required();
  command->add_option("RIGHT", seen->right, "the right eye's picture");
  command->add_option("--near", seen->near, "a frame somewhere near: tried first, and the map only if it is not there");
  add_view_options(*command, seen->camera);
  command->footer(
      "Of a picture whose camera is known more have an answer than of a photograph of an unknown one, which needs 40 "
      "points\n"
      "that agree on its lens, too. In a mono session nothing is localised (relmap match). docs/figures.md, "
      "Photographs, has\n"
      "what was measured.\n"
      "A picture by itself is taken for the left eye's, unless its folder (cam1, image_1, image_03, right) or else "
      "its\n"
      "name (right, door_right), or where they say nothing the calibration's, says that it is the right one's: then "
      "the\n"
      "answer is where that eye stood.\n"
      "With --json a refusal is an object, too: {\"error\": {\"reason\": \"NEW_PLACE\", \"message\": \"...\"}}; the "
      "exit\n"
      "code is as without --json.\n"
      "Examples:\n"
      "  relmap localise left.png right.png --calibration calib.txt\n"
      "  relmap localise photo.jpg --near 1:120\n"
      "  relmap localise 3:120   # where else was this frame seen?");
  command->callback([&action, seen] {
    action = [seen](client::Client& client, terminal::Console& console) {
      Status status = localise(*seen, client, console);
      if (!status.ok()) console.reply(refusal_json(status));
      return status;
    };
  });
}

void add_match(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("match", "which places of the map a picture could show");
  auto seen = std::make_shared<Seen>();
  command->add_option("PICTURE", seen->left, "JPEG or PNG of any camera; or a frame of the map, as 3:120")->required();
  command->footer(
      "Places that geometry confirms come first, those with most inliers before others; then the rest, likeliest "
      "first. What is\n"
      "not confirmed is a guess. Somebody else's photograph of the same front is often the first place and seldom "
      "confirmed\n"
      "(docs/figures.md, Photographs: 10 and 4 of 10); rooms that look alike are not confirmed (AMBIGUOUS_PLACE).\n"
      "Of a frame of the map: other sessions' places, and its own session's that it had seen before.\n"
      "Examples:\n"
      "  relmap match photo.jpg --thumbnails places/\n"
      "  relmap match 2:17   # which other places look like this frame?");
  command->add_option("--max", seen->match.max_places, "places, at most (20)");
  command
      ->add_option("--verify", seen->match.max_verified,
                   "of the likeliest places so many at most are compared with the picture point by point (10)")
      ->check(CLI::Range(1, 20));
  command->add_option("--near", seen->near, "a frame somewhere near: places around it are likelier");
  command->add_option("--thumbnails", seen->thumbnails, "folder for a small picture of each place, SESSION-INDEX.jpg");
  add_view_options(*command, seen->camera);
  command->callback([&action, seen] {
    action = [seen](client::Client& client, terminal::Console& console) -> Status {
      const auto view = make_view(client, console, seen->left, "", seen->camera);
      if (!view.ok()) return view.status();
      client::MatchOptions match = seen->match;
      const auto near = near_frame(*seen);
      if (!near.ok()) return near.status();
      match.near = *near;
      match.thumbnails = !seen->thumbnails.empty();
      const auto matches = client.match_image(*view, match);
      if (!matches.ok()) return matches.status();
      if (match.thumbnails)
        if (Status status = write_thumbnails(matches->places, seen->thumbnails); !status.ok()) return status;
      if (!console.json) print(*matches, console);
      return {};
    };
  });
}

}  // namespace relmap::cli
