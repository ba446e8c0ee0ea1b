#include "tools/relmap/view_options.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>

#include "proto/base/number_text.h"
#include "proto/base/visible_text.h"
#include "proto/calibration/calibration.h"
#include "proto/geometry/camera.h"
#include "tools/relmap/eye_names.h"
#include "tools/relmap/picture_file.h"

namespace relmap::cli {

namespace {

bool is_deleted(const client::Session& session) { return session.state == client::SessionState::kDeleting; }

bool looks_like_picture(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg";
}

// The right eye of a rectified rig as a camera of its own; poses are those of that eye.
StereoCamera right_eye_of(StereoCamera rig) {
  rig.baseline = 0;
  return rig;
}

void tell_right_eye(terminal::Console& console) {
  console.err() << "camera: the right eye, according to the name; the answer is the pose of that eye\n";
}

// Sets the camera that the file describes, for pictures of the size of view.left; `right`: of its right eye.
Status use_calibration(terminal::Console& console, const std::string& path, bool right, client::View& view) {
  auto calibration = load_calibration(path);
  if (!calibration.ok()) return calibration.status();
  if (calibration->width == 0) {
    const auto size = pixel_size(view.left);
    if (!size.ok()) return size.status();
    calibration->width = size->width;
    calibration->height = size->height;
  }
  if (Status status = calibration->check_plausible(); !status.ok()) return status;
  if (right && !calibration->mono()) {
    *calibration = calibration->right_eye();
    tell_right_eye(console);
  }
  if (calibration->rectified)
    view.camera = calibration->rectified_camera();
  else
    view.camera = *calibration;
  return {};
}

// Whether the calibration can belong to pictures of this size.
bool fits(const StereoCalibration& calibration, const PixelSize& size) {
  return calibration.width == 0 || (calibration.width == size.width && calibration.height == size.height);
}

// Where a data set keeps the calibration of its pictures: in their folder, or in the one above. KITTI and EuRoC have
// the pictures in a further folder "data".
std::optional<std::string> calibration_beside(const std::string& picture, const PixelSize& size, bool pair) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path folder = fs::absolute(picture, error).parent_path();
  if (folder.filename() == "data") folder = folder.parent_path();
  for (const fs::path& place : {folder, folder.parent_path()}) {
    const auto calibration = load_calibration(place.string());
    if (calibration.ok() && fits(*calibration, size) && !(pair && calibration->mono())) return place.string();
  }
  return std::nullopt;
}

// Sets the right eye of a session's rig as the camera, raw or rectified, whichever has the size of the picture. If
// neither has, the camera stays the session, and the daemon refuses the picture by name.
void use_right_eye(const client::Session& session, terminal::Console& console, client::View& view) {
  const auto size = pixel_size(view.left);
  if (!size.ok()) return;
  if (session.raw && !view.rectified && fits(*session.raw, *size))
    view.camera = session.raw->right_eye();
  else if (size->width == session.camera.width && size->height == session.camera.height)
    view.camera = right_eye_of(session.camera);
  else
    return;
  view.rectified = false;
  tell_right_eye(console);
}

Status use_session(client::Client& client, terminal::Console& console, const ViewOptions& options, bool right,
                   client::View& view) {
  const auto number = find_session(client, console, options.session);
  if (!number.ok()) return number.status();
  view.camera = *number;
  view.rectified = options.rectified;
  if (!right) return {};
  const terminal::Console::Aside aside(console);
  const auto sessions = client.sessions();
  if (!sessions.ok()) return sessions.status();
  for (const client::Session& session : *sessions)
    if (session.number == *number && !is_deleted(session) && session.camera.is_stereo())
      use_right_eye(session, console, view);
  return {};
}

Status guess_camera(client::Client& client, terminal::Console& console, const std::string& picture, bool right,
                    client::View& view) {
  const auto size = pixel_size(view.left);
  if (!size.ok()) return {};  // the daemon will tell what is wrong with the picture
  const bool pair = !view.right.empty();
  if (const auto beside = calibration_beside(picture, *size, pair)) {
    console.err() << "camera: the calibration in " << *beside << '\n';
    return use_calibration(console, *beside, right, view);
  }
  const terminal::Console::Aside aside(console);
  auto sessions = client.sessions();
  if (!sessions.ok()) return sessions.status();
  // The camera of a mono session may be a guess itself.
  std::erase_if(*sessions, [&](const client::Session& session) {
    const StereoCamera& camera = session.camera;
    return is_deleted(session) || !camera.is_stereo() || camera == kNoCamera ||
           !((size->width == camera.width && size->height == camera.height) ||
             (session.raw && fits(*session.raw, *size)));
  });
  std::string why = "no session has pictures of " + size_text(size->width, size->height);
  if (!sessions->empty()) {
    const client::Session& first = sessions->front();
    const bool same = std::all_of(sessions->begin(), sessions->end(), [&](const client::Session& session) {
      return session.camera == first.camera && session.raw == first.raw;
    });
    if (same) {
      view.camera = first.number;
      view.supposed = true;
      const std::string name = visible_text(first.name);
      console.err() << "camera: that of session " << name << (first.raw ? ", unrectified" : "")
                    << ", since its pictures have this size; --session " << name << " if you know that it is\n";
      view.either_eye = !pair && first.raw && eye_of_picture(picture) == Eye::kNotSaid;
      if (view.either_eye)
        console.err() << "camera: its left eye, but the covariance of the rotation allows for the right eye; a name "
                         "that ends in _left or _right tells which\n";
      if (right) use_right_eye(first, console, view);
      return {};
    }
    why = "sessions with different cameras have pictures of this size";
  }
  if (!pair) return {};
  return {Reason::NO_CALIBRATION, "a stereo pair needs its calibration: there is none beside it, and " + why +
                                      "; give --calibration FILE or --session NAME"};
}

// Whether a single picture is the right eye's, by its name or else by the name of the given calibration.
bool is_of_right_eye(const std::string& picture, const ViewOptions& options) {
  const Eye eye = eye_of_picture(picture);
  if (eye != Eye::kNotSaid || options.calibration.empty()) return eye == Eye::kRight;
  return eye_of_calibration(options.calibration) == Eye::kRight;
}

}  // namespace

void add_view_options(CLI::App& command, ViewOptions& options) {
  auto* file = command
                   .add_option("--calibration", options.calibration,
                               "calibration of the pictures' camera: a KITTI, OpenCV or EuRoC file, or the folder of "
                               "a data set")
                   ->type_name("FILE|FOLDER");
  command
      .add_option("--session", options.session,
                  "the pictures were taken with the camera of this session (number or name)")
      ->type_name("SESSION")
      ->excludes(file);
  command
      .add_flag("--rectified", options.rectified,
                "with --session: the pictures are rectified, like those in the map (default: they are as the camera "
                "takes them)")
      ->needs("--session");
}

Result<client::View> make_view(client::Client& client, terminal::Console& console, const std::string& left,
                               const std::string& right, const ViewOptions& options) {
  client::View view;
  if (const auto frame = FrameId::parse(left); frame && right.empty()) {
    if (!options.calibration.empty() || !options.session.empty())
      return {Reason::INVALID_ARGUMENT,
              "frame " + left + " was taken with its session's camera: no camera can be given"};
    view.frame = *frame;
    return view;
  }
  auto picture = read_picture_file(left);
  if (!picture.ok()) return picture.status();
  view.left = std::move(picture).value();
  if (!right.empty()) {
    picture = read_picture_file(right);
    if (!picture.ok()) return picture.status();
    view.right = std::move(picture).value();
  }
  const bool of_right = right.empty() && is_of_right_eye(left, options);
  const Status status = !options.calibration.empty() ? use_calibration(console, options.calibration, of_right, view)
                        : !options.session.empty()   ? use_session(client, console, options, of_right, view)
                                                     : guess_camera(client, console, left, of_right, view);
  if (!status.ok()) return status;
  return view;
}

Result<SessionNumber> find_session(client::Client& client, terminal::Console& console, const std::string& text) {
  SessionNumber number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc{} && end == text.data() + text.size()) return number;
  const terminal::Console::Aside aside(console);
  const auto sessions = client.sessions();
  if (!sessions.ok()) return sessions.status();
  std::vector<client::Session> called;
  for (const client::Session& session : *sessions)
    if (session.name == text || session.uuid == text || session.robot + "/" + session.name == text)
      called.push_back(session);
  // A deleted session counts only if no other has the name.
  if (!std::all_of(called.begin(), called.end(), is_deleted)) std::erase_if(called, is_deleted);
  if (called.empty()) return {Reason::NO_SUCH_SESSION, "no session is called '" + text + "'"};
  if (called.size() == 1) return called.front().number;
  std::string which;
  for (const client::Session& session : called)
    which += (which.empty() ? "" : ", ") + std::to_string(session.number) + " (robot " + session.robot + ")";
  return {Reason::INVALID_ARGUMENT, std::to_string(called.size()) + " sessions are called '" + text + "': " + which +
                                        "; name one by its number, or as ROBOT/NAME"};
}

Result<client::RouteEnd> make_route_end(client::Client& client, terminal::Console& console, const std::string& text,
                                        const ViewOptions& options) {
  constexpr std::string_view kLabel = "label:", kPicture = "picture:", kRobot = "robot:";
  if (text.starts_with(kRobot)) return client::RouteEnd(client::Robot{text.substr(kRobot.size())});
  if (text.starts_with(kLabel)) return client::RouteEnd(text.substr(kLabel.size()));
  const bool picture = text.starts_with(kPicture);
  if (const auto frame = FrameId::parse(text); frame && !picture) return client::RouteEnd(*frame);
  if (!picture && !looks_like_picture(text)) return client::RouteEnd(text);
  if (std::error_code ignored; !picture && !std::filesystem::exists(text, ignored))
    return {Reason::NO_SUCH_FILE, "there is no picture '" + text + "'; a label of that name is written label:" + text};
  auto view = make_view(client, console, picture ? text.substr(kPicture.size()) : text, "", options);
  if (!view.ok()) return view.status();
  return client::RouteEnd(std::move(view).value());
}

Result<FrameId> parse_frame(const std::string& text) {
  if (const auto frame = FrameId::parse(text)) return *frame;
  return {Reason::INVALID_ARGUMENT, "'" + text + "' is no frame; a frame is written session:index, as 3:120"};
}

}  // namespace relmap::cli
