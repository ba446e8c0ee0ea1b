// relmap label and labels: labels are edited and listed.
#include <memory>
#include <ostream>
#include <set>
#include <string>
#include <vector>

#include "proto/base/visible_text.h"
#include "tools/relmap/commands.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

struct LabelOptions {
  std::string place, name;
  bool remove = false;
  ViewOptions camera;
};

struct Shown {
  FrameId frame;
  std::uint32_t inliers = 0;
  client::Verification verification = client::Verification::kNone;
};

// The frame that a picture shows, if geometry confirms it. No route leads to photographs (mono sessions), so one of
// them is returned only if no other frame shows the place, however well it fits.
Result<Shown> find_shown(const client::View& view, client::Client& client, terminal::Console& console) {
  const auto matches = client.match_image(view, {});
  if (!matches.ok()) return matches.status();
  const terminal::Console::Aside aside(console);
  const auto sessions = client.sessions();
  if (!sessions.ok()) return sessions.status();
  std::set<SessionNumber> mono;
  for (const client::Session& session : *sessions)
    if (!session.camera.is_stereo()) mono.insert(session.number);
  const Status& nothing = matches->nothing_verified;
  if (nothing.ok())
    for (const client::PlaceMatch& place : matches->places)
      if (place.unverified.ok() && !mono.contains(place.frame.session))
        return Shown{place.frame, place.inliers, place.verification};
  if (mono.empty()) return nothing;
  // Photographs may have displaced other frames from the likeliest places, or made the best one ambiguous.
  if (const auto found = client.localise(view); found.ok())
    return Shown{found->frame, found->inliers, found->verification};
  if (!nothing.ok()) return nothing;
  const client::PlaceMatch& best = matches->places.front();
  console.err() << "only photographs show this place; no route leads to them: session " << best.frame.session << '\n';
  return Shown{best.frame, best.inliers, best.verification};
}

Result<FrameId> find_place(const LabelOptions& options, client::Client& client, terminal::Console& console) {
  if (const auto frame = FrameId::parse(options.place)) return *frame;
  const auto view = make_view(client, console, options.place, "", options.camera);
  if (!view.ok()) return view.status();
  const auto shown = find_shown(*view, client, console);
  if (!shown.ok()) return shown.status();
  console.err() << options.place << " shows " << shown->frame.to_string() << ": " << shown->inliers << " inliers ("
                << name_of(shown->verification) << ")\n";
  return shown->frame;
}

Status label(const LabelOptions& options, client::Client& client, terminal::Console& console) {
  const auto frame = find_place(options, client, console);
  if (!frame.ok()) return frame.status();
  const auto labels = client.set_label(*frame, options.name, !options.remove);
  if (!labels.ok()) return labels.status();
  if (console.json) return {};
  console.out() << frame->to_string() << ':';
  for (const std::string& text : *labels) console.out() << ' ' << visible_text(text);
  console.out() << '\n';
  return {};
}

}  // namespace

void add_label(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("label", "give a frame a label, or remove the label");
  auto options = std::make_shared<LabelOptions>();
  command
      ->add_option("PLACE", options->place,
                   "a frame (session:index), or a picture: the frame that it shows, if geometry confirms it")
      ->type_name("FRAME|PICTURE")
      ->required();
  command->add_option("NAME", options->name, "the label: 1 to 64 bytes, not only white space")->required();
  command->add_flag("--remove", options->remove, "remove the label");
  add_view_options(*command, options->camera);
  command->footer(
      "A picture labels the frame that it shows, one that routes lead to. If only photographs (a mono session) show "
      "the\n"
      "place, one of these is labelled, and a message says so.\n"
      "Examples:\n"
      "  relmap label 3:120 kitchen\n"
      "  relmap label photo.jpg 'Trafalgar Square'");
  command->callback([&action, options] {
    action = [options](client::Client& client, terminal::Console& console) { return label(*options, client, console); };
  });
}

void add_labels(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("labels", "list labels and their frames");
  struct Asked {
    std::string prefix, words;
  };
  auto asked = std::make_shared<Asked>();
  command->add_option("PREFIX", asked->prefix, "only labels that begin with this, in upper or lower case");
  command->add_option("--words", asked->words, "only labels with words that begin like these, as 'traf sq'");
  command->footer(
      "Upper and lower case (a to z) are not distinguished.\n"
      "Examples:\n"
      "  relmap labels\n"
      "  relmap labels traf             # \"Traffic light\", and \"Trafalgar Square\"\n"
      "  relmap labels --words 'sq traf'");
  command->callback([&action, asked] {
    action = [asked](client::Client& client, terminal::Console& console) -> Status {
      const auto labels = client.labels(asked->prefix, asked->words);
      if (!labels.ok()) return labels.status();
      std::vector<std::vector<std::string>> rows;
      for (const client::LabelledFrames& found : *labels)
        for (const FrameId frame : found.frames) rows.push_back({found.label, frame.to_string()});
      if (!console.json) console.table({"label", "frame"}, rows);
      return {};
    };
  });
}

}  // namespace relmap::cli
