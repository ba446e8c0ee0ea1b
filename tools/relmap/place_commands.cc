// relmap localise and match: where a picture was taken, and which places it could show.
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>

#include "client/pair_picture.h"
#include "proto/base/visible_text.h"
#include "tools/relmap/commands.h"
#include "tools/relmap/pairs.h"
#include "tools/relmap/picture_file.h"
#include "tools/relmap/picture_output.h"
#include "tools/relmap/typed_text.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

struct Seen {
  std::string left, right, near;
  client::MatchOptions match;
  std::string thumbnails;  // folder
  std::string out;         // picture
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
  console.facts(
      {{"frame", found.frame.to_string()},
       {"position in it",
        terminal::vector_text(found.T_frame_view.t) + " m, sigmas " + terminal::vector_text(sigma.head<3>())},
       {"rotation in it", terminal::vector_text(so3_log(found.T_frame_view.R)) + " rad, sigmas " +
                              terminal::vector_text(sigma.tail<3>())},
       {"inliers", std::to_string(found.inliers) + " (" + name_of(found.verification) + "), over " +
                       fixed(100 * found.spread, 0) + " % of the picture" +
                       focal_length_text(found.estimated_focal_length)},
       {"probability",
        found.near_prior ? std::string("not computed: the view was found near the frame given by --near")
                         : fixed(found.probability, 4) + " by appearance; a new place " + fixed(found.new_place, 4)}});
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
    console.err() << "geometry confirms none of them: " << visible_text(matches.nothing_verified.to_string()) << '\n';
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

// The view at the left of each pair.
Result<AskedView> asked_view(const Seen& seen, const client::View& view, const SessionsByNumber& sessions,
                             client::Client& client) {
  AskedView asked{std::filesystem::path(seen.left).filename().string(), {}};
  if (view.frame) {
    asked.title = view.frame->to_string();
    asked.picture = kept_picture(*view.frame, sessions, client);
    return asked;
  }
  const auto size = client::picture_size(view.left);
  if (!size.ok()) return size.status();
  asked.picture = {view.left, static_cast<std::uint32_t>(size->x()), static_cast<std::uint32_t>(size->y()), 1, {}};
  return asked;
}

Status write_matches(const Seen& seen, const client::View& view, const client::PlaceMatches& matches,
                     client::Client& client, terminal::Console& console) {
  constexpr std::size_t kMaxRows = 8;
  const auto format = client::picture_format(seen.out);
  if (!format.ok()) return format.status();
  if (matches.places.empty()) return {Reason::NEW_PLACE, "there is no place to draw"};
  const terminal::Console::Aside aside(console);
  const auto sessions = read_sessions(client, console);
  if (!sessions.ok()) return sessions.status();
  const auto asked = asked_view(seen, view, *sessions, client);
  if (!asked.ok()) return asked.status();
  client::PairSheet sheet;
  sheet.title = "Where " + asked->title + " could be";
  sheet.subtitle =
      "A place that the map does not hold: probability " + fixed(matches.new_place, 3) + " by appearance." +
      (matches.nothing_verified.ok() ? "" : " No place is confirmed: " + matches.nothing_verified.to_string());
  for (const client::PlaceMatch& place : matches.places) {
    if (sheet.pairs.size() == kMaxRows) break;
    sheet.pairs.push_back(pair_of(*asked, place, *sessions, client));
    sheet.pairs.back().title = std::to_string(sheet.pairs.size()) + ". " + sheet.pairs.back().title;
  }
  const auto bytes = client::draw_pair_sheet(sheet, *format);
  return bytes.ok() ? write_output(seen.out, *bytes, console) : bytes.status();
}

}  // namespace

void add_localise(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("localise", "find where a picture or a stereo pair was taken");
  auto seen = std::make_shared<Seen>();
  command->add_option("LEFT", seen->left, "picture (JPEG or PNG, of any camera), or a frame of the map, as 3:120")
      ->type_name("PICTURE|FRAME")
      ->required();
  command->add_option("RIGHT", seen->right, "the right picture of a stereo pair")->type_name("PICTURE");
  command
      ->add_option("--near", seen->near,
                   "search around this frame first, and in the whole map only if nothing is found there")
      ->type_name("FRAME")
      ->check(parsed_by(parse_frame));
  add_view_options(*command, seen->camera);
  command->footer(
      "Prints the frame of the map that the picture shows, and the camera's pose in that frame.\n"
      "Name the camera by --calibration or --session if you can: then more pictures are localised. Without them the\n"
      "calibration beside the picture is used, else the camera of sessions whose pictures have the same size. A "
      "picture\n"
      "of an unknown camera needs 40 points that agree, since its lens is estimated, too. How often pictures are "
      "found\n"
      "and how exactly: docs/figures.md, Photographs. Sessions of photographs (mono) have no scale, so nothing is\n"
      "localised in them; relmap match finds their places.\n"
      "A single picture counts as the left eye's unless its folder (cam1, image_1, image_03, right), else its own "
      "name\n"
      "(right, door_right), else the name of the calibration says that it is the right eye's. The answer is then the\n"
      "pose of the right eye.\n"
      "Examples:\n"
      "  relmap localise left.png right.png --calibration calib.txt\n"
      "  relmap localise photo.jpg --near 1:120\n"
      "  relmap localise 3:120   # where else was the place of this frame seen?");
  command->callback([&action, seen] {
    action = [seen](client::Client& client, terminal::Console& console) { return localise(*seen, client, console); };
  });
}

void add_match(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("match", "list the places of the map that a picture could show");
  auto seen = std::make_shared<Seen>();
  command->add_option("PICTURE", seen->left, "picture (JPEG or PNG, of any camera), or a frame of the map, as 3:120")
      ->type_name("PICTURE|FRAME")
      ->required();
  command->footer(
      "Places that geometry confirms are listed first, most inliers first; then the others, most probable first. A "
      "place\n"
      "that is not confirmed is a guess. Another person's photograph of a building finds its place often as the first "
      "one,\n"
      "but confirmed more rarely (docs/figures.md, Photographs: 10 and 4 of 10). Rooms that look alike are not "
      "confirmed\n"
      "(AMBIGUOUS_PLACE). For a frame of the map, the places are those of other sessions, and those that its own "
      "session\n"
      "had seen before.\n"
      "Examples:\n"
      "  relmap match photo.jpg --thumbnails places/\n"
      "  relmap match photo.jpg --out match.png   # with the best places beside it, and what both show joined by "
      "lines\n"
      "  relmap match 2:17   # which other places look like this frame?");
  command->add_option("--max", seen->match.max_places, "list at most so many places (default 20)");
  command
      ->add_option("--verify", seen->match.max_verified,
                   "verify at most so many of the most probable places by geometry (default 10)")
      ->check(CLI::Range(1, 20));
  command
      ->add_option("--near", seen->near,
                   "a frame near which the picture was taken: places around it become more probable")
      ->type_name("FRAME")
      ->check(parsed_by(parse_frame));
  command
      ->add_option("--thumbnails", seen->thumbnails,
                   "write a small picture of each place to this folder, as SESSION-INDEX.jpg")
      ->type_name("FOLDER");
  command
      ->add_option("--out", seen->out,
                   "draw the picture beside each of the best places (at most 8), with what both show joined by lines: "
                   "FILE.png or FILE.svg")
      ->type_name("FILE");
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
      match.correspondences = !seen->out.empty();
      const auto matches = client.match_image(*view, match);
      if (!matches.ok()) return matches.status();
      if (match.thumbnails)
        if (Status status = write_thumbnails(matches->places, seen->thumbnails); !status.ok()) return status;
      if (!seen->out.empty())
        if (Status status = write_matches(*seen, *view, *matches, client, console); !status.ok()) return status;
      if (!console.json) print(*matches, console);
      return {};
    };
  });
}

}  // namespace relmap::cli
