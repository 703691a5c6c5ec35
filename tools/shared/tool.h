// SPDX-License-Identifier: Apache-2.0
// What all programs share: options, messages, progress, stage times and the statistics file.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "tools/shared/progress_lines.h"
#include "volcomp/base/distinct_files.h"
#include "volcomp/base/progress.h"

namespace volcomp {

/// One run of a program. Messages go to stderr, so that stdout stays free.
class Tool {
public:
    /// Adds --quiet, --threads, --version, --stats and --scene-keys.
    Tool(const std::string& name, const std::string& description);

    CLI::App app;
    nlohmann::json stats; ///< written by --stats

    /// Adds a flag that prints what `text` returns, whatever else is given, and exits.
    void addPrint(const std::string& flag, const std::string& meaning,
                  std::function<std::string()> text);

    /// Parses the arguments, starts OpenVDB and calls `run`. Returns the exit status of the
    /// program: 0; 1 after an exception, which becomes one message on stderr, and if stdout does
    /// not take what was to be printed; 2 for wrong arguments. A lack of memory or threads that no
    /// one catches, such as in a thread of a library, ends the program with a message and status 1.
    int main(int argc, char** argv, const std::function<void()>& run);

    /// To be called before the work begins. Throws Error if one of the outputs, or the statistics
    /// file, cannot be written, is another one of them, or is one of the inputs. Files without a
    /// path are passed over.
    void requireFiles(const std::vector<NamedFile>& inputs, std::vector<NamedFile> outputs) const;

    void say(const std::string& message) const;  ///< silent with --quiet
    void warn(const std::string& message) const; ///< also with --quiet

    /// Runs one stage: calls work(progress), shows its progress (a bar on a terminal, otherwise
    /// ProgressLines) and at the end its name and how long it took, and adds its wall and CPU
    /// seconds to the statistics. Returns what `work` returns.
    template <class F>
    auto stage(const std::string& name, F&& work)
    {
        Stage s(*this, name);
        return work(s.progress());
    }

private:
    class Stage {
    public:
        Stage(Tool& tool, const std::string& name);
        ~Stage();
        Progress progress();

    private:
        Tool& m_tool;
        std::string m_name;
        double m_wall, m_cpu, m_shown = 0;
        ProgressLines m_lines;
        int m_exceptions;
    };
    bool m_quiet = false;
    int m_threads = 0;
    std::vector<std::pair<std::string, std::function<std::string()>>> m_prints;
    std::filesystem::path m_stats;
    std::string m_name;
};

} // namespace volcomp
