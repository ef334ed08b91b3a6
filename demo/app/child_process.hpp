#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace cumulet::demo {

/// A program that runs beside this one. All calls from one thread.
class ChildProcess {
 public:
  /// Descriptors that become its standard output and error; nullopt: nowhere.
  struct Streams {
    std::optional<int> output;
    std::optional<int> errors;
  };

  /// arguments: the path of the program, and its arguments. Throws std::system_error if it cannot be started.
  ChildProcess(std::vector<std::string> arguments, const Streams& streams);
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  /// Ends the program by SIGTERM if it runs.
  ~ChildProcess();

  /// Returns the program's status, as waitpid does, when it has ended. That of a failure if the system has none.
  [[nodiscard]] std::optional<int> status();
  /// Sends the signal and waits until the program has ended.
  void end(int signal);
  /// Gives the program less of the processors than others. niceness: 0 to 19.
  void yield(int niceness) const;

 private:
  pid_t process_ = 0;
  std::optional<int> status_;  // nullopt: it runs
};

/// Returns the path of a program in the folder of this one, or in another folder relative to that; "" if it is in
/// neither.
[[nodiscard]] std::string find_program(const std::string& name, const std::string& other_folder = ".");

}  // namespace cumulet::demo
