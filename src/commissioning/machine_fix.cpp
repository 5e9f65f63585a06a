#include "machine_fix.hpp"

namespace upright {

namespace {

namespace fs = std::filesystem;

// The package installs the same files.
constexpr const char* limits_text =
#include "limits_text.inc"
    ;
constexpr const char* rules_text =
#include "rules_text.inc"
    ;

bool is_problem(const Finding& finding) {
  return finding.health == Health::poor || finding.health == Health::bad;
}

std::vector<std::string> file_written(const std::string& file, const std::string& text) {
  return {"cat >" + file + " <<'END'", text + "END"};
}

void append(std::vector<std::string>& to, const std::vector<std::string>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

/// The group that may have real-time priority, locked memory and the devices.
std::vector<std::string> group_made(const std::string& user, const fs::path& root) {
  const std::string limits = "/etc/security/limits.d/upright.conf";
  const std::string rules = "/etc/udev/rules.d/60-upright.rules";
  const std::string packaged = "usr/lib/udev/rules.d/60-upright.rules";
  std::vector<std::string> lines{"groupadd --force --system upright"};
  if (!fs::exists(root / limits.substr(1))) append(lines, file_written(limits, limits_text));
  if (!fs::exists(root / rules.substr(1)) && !fs::exists(root / packaged))
    append(lines, file_written(rules, rules_text));
  append(lines, {"udevadm control --reload && udevadm trigger",
                 "usermod --append --groups upright " + user + "   # then log in again"});
  return lines;
}

/// The commands for a problem with this subject; none: the remedy is not a command.
std::vector<std::string> commands_for(const std::string& subject) {
  if (subject == "kernel") return {"apt-get install linux-image-rt-amd64   # then boot it"};
  if (subject == "governor")
    return {"apt-get install linux-cpupower", "cpupower frequency-set --governor performance"};
  if (subject == "throttling")
    return {"sysctl --write kernel.sched_rt_period_us=1000000 kernel.sched_rt_runtime_us=950000"};
  if (subject == "USB converters")
    return {"for timer in /sys/bus/usb-serial/devices/*/latency_timer; do echo 1 >\"$timer\"; done"};
  return {};
}

bool is_about_group(const Finding& finding) {
  return finding.subject == "rtprio" || finding.subject == "memlock" || finding.subject == "sleep states";
}

}  // namespace

std::vector<std::string> commands_to_fix(const std::vector<Finding>& findings, const std::string& user,
                                         const fs::path& root) {
  std::vector<std::string> lines, group, by_hand;
  for (const Finding& finding : findings) {
    if (!is_problem(finding)) continue;
    const std::string cause = "# " + finding.subject + ": " + finding.what;
    if (is_about_group(finding)) {
      group.push_back(cause);
    } else if (const std::vector<std::string> commands = commands_for(finding.subject); !commands.empty()) {
      lines.push_back(cause);
      append(lines, commands);
    } else {
      append(by_hand, {cause, "#   -> " + finding.remedy});
    }
  }
  if (!group.empty()) {
    append(group, group_made(user, root));
    append(group, lines);
    lines = group;
  }
  append(lines, by_hand);
  if (!by_hand.empty())
    lines.emplace_back(
        "# Boot options: add them to GRUB_CMDLINE_LINUX_DEFAULT in /etc/default/grub, run "
        "update-grub, and boot.");
  return lines;
}

}  // namespace upright
