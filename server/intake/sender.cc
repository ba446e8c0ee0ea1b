#include "server/intake/sender.h"

namespace relmap::intake {

Status may_send(const Sender& sender, const SessionUuid& session, const Owner& owner) {
  if (!sender.robot.empty() && sender.robot != owner.robot)
    return {Reason::NOT_ALLOWED,
            sender.robot + " may not send to session " + session.to_string() + ", which is another robot's"};
  if (sender.anyone && owner.proves)
    return {Reason::NOT_ALLOWED,
            "nobody may send to session " + session.to_string() + " who does not prove to be robot " + owner.robot};
  return {};
}

Party party_of(const SessionUuid& session, const Sender& sender, const Owner* owner) {
  if (!sender.robot.empty()) return {{}, sender.robot};
  return owner && may_send(sender, session, *owner).ok() ? Party{session, {}} : Party{};
}

}  // namespace relmap::intake
