// Many cases, each as often as there are variants. The work happens in a child
// process: a driver that crashes or hangs costs one case, and the next child
// goes on behind it.
#include <fnmatch.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>

#include "backend.h"
#include "report.h"

namespace rtc::run {
namespace {

using tools::Error;

struct Task {
    std::string file, variant;
};

struct Outcome {
    enum class Kind { Passed, Failed, Skipped, NotApplicable } kind = Kind::Failed;
    std::string detail;
    std::vector<CellResult> cells;
    double seconds = 0;
};

bool fits(const std::string& name, const std::string& filter) {
    if (filter.find_first_of("*?") == std::string::npos) return name.find(filter) != std::string::npos;
    return fnmatch(filter.c_str(), name.c_str(), 0) == 0 || fnmatch((filter + ".json").c_str(), name.c_str(), 0) == 0;
}

}  // namespace

std::vector<std::string> suite_files(const std::string& folder, const std::string& filter) {
    std::vector<std::string> files;
    std::filesystem::path root(folder);
    if (std::filesystem::is_regular_file(root)) return {folder};
    if (!std::filesystem::is_directory(root)) throw Error("there is no folder '" + folder + "'");
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root))
        if (entry.path().extension() == ".json" && entry.path().filename().string()[0] != '_') {
            std::string relative = std::filesystem::relative(entry.path(), root).string();
            if (filter.empty() || fits(relative, filter)) files.push_back(entry.path().string());
        }
    std::sort(files.begin(), files.end());
    return files;
}

namespace {

bool applies(const Job& job, const Variant& variant, std::string& skip) {
    bool written_nv = std::any_of(job.sources.begin(), job.sources.end(), [](const StageSource& source) {
        return !source.text.empty() && native::is_nv(source.text);
    });
    bool written_ext = std::any_of(job.sources.begin(), job.sources.end(), [](const StageSource& source) {
        return !source.text.empty() && !native::is_nv(source.text);
    });
    bool binary = std::any_of(job.sources.begin(), job.sources.end(),
                              [](const StageSource& source) { return !source.words.empty(); });
    // A case written in EXT has no NV twin; SPIR-V cannot be rewritten.
    if (variant.dialect == Dialect::AsWritten && !written_nv && written_ext && !binary) return false;
    if (variant.dialect == Dialect::Ext && binary && written_nv) return false;
    if (!job.only.empty() &&
        std::none_of(job.only.begin(), job.only.end(),
                     [&](const std::string& attribute) { return variant.attributes.count(attribute); }))
        return false;
    for (const auto& [attribute, reason] : job.skip)
        if (variant.attributes.count(attribute)) skip = reason;
    return true;
}

std::string oracle_path(const std::string& folder, const Job& job) {
    std::string name = job.name;
    std::replace(name.begin(), name.end(), '/', '.');
    return (std::filesystem::path(folder) / (name + ".bin")).string();
}

void save_oracle(const std::string& path, const RunResult& result) {
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    std::ofstream out(path, std::ios::binary);
    for (const Output& output : result.outputs)
        out.write(reinterpret_cast<const char*>(output.bytes.data()), std::streamsize(output.bytes.size()));
}

// The shape is that of the run at hand; only the bytes come from the file.
RunResult load_oracle(const std::string& path, const RunResult& shape) {
    std::string bytes = native::read_text(path);
    RunResult result = shape;
    size_t at = 0;
    for (Output& output : result.outputs) {
        if (at + output.bytes.size() > bytes.size())
            throw Error(path + ": recorded for another version of the case");
        std::copy_n(bytes.begin() + long(at), output.bytes.size(), output.bytes.begin());
        at += output.bytes.size();
    }
    return result;
}

Outcome run_one(const Task& task, const SuiteOptions& options, const std::function<Host&(Backend)>& host_of) {
    Outcome outcome;
    auto start = std::chrono::steady_clock::now();
    try {
        Job job = load_case(task.file);
        Variant variant = variant_of(task.variant);
        std::string skip;
        if (!applies(job, variant, skip)) {
            outcome.kind = Outcome::Kind::NotApplicable;
            return outcome;
        }
        if (!skip.empty()) {
            outcome.kind = Outcome::Kind::Skipped;
            outcome.detail = skip;
            return outcome;
        }
        Host& host = host_of(variant.backend);
        size_t said = host.context().validation_messages().size();
        compile(job, variant.dialect);
        RtcOptions rtc = options.rtc;
        rtc.print_warnings = options.verbose;
        RunResult result = host.run(variant.backend, job, rtc);
        RunResult oracle;
        bool has_oracle = false;
        if (options.compare && variant.backend != Backend::Khr) {
            Job twin = load_case(task.file);
            compile(twin, Dialect::Ext);
            oracle = host.run(Backend::Khr, twin, rtc);
            has_oracle = true;
        } else if (!options.oracle.empty()) {
            oracle = load_oracle(oracle_path(options.oracle, job), result);
            has_oracle = true;
        } else if (!options.save_oracle.empty()) {
            save_oracle(oracle_path(options.save_oracle, job), result);
            oracle = result;
            has_oracle = true;
        }
        outcome.cells = check_expectations(job, result, has_oracle ? &oracle : nullptr);
        outcome.kind = Outcome::Kind::Passed;
        for (CellResult& cell : outcome.cells) {
            if (variant.backend == Backend::Rtc) cell.known.clear();
            if (!cell.passed && cell.known.empty()) {
                outcome.kind = Outcome::Kind::Failed;
                if (outcome.detail.empty()) outcome.detail = cell.cell + ": " + cell.detail;
            }
        }
        std::string got = result.launch_error.substr(0, result.launch_error.find(':'));
        if (variant.backend == Backend::Rtc && got != job.launch_error) {
            outcome.kind = Outcome::Kind::Failed;
            outcome.detail =
                "launch error '" + result.launch_error + "', expected '" + job.launch_error + "'";
        }
        const auto& messages = host.context().validation_messages();
        if (messages.size() > said) {
            outcome.kind = Outcome::Kind::Failed;
            outcome.detail = "validation: " + messages[said];
        }
    } catch (const tools::MissingFeature& e) {
        outcome.kind = Outcome::Kind::Skipped;
        outcome.detail = e.what();
    } catch (const std::exception& e) {
        outcome.kind = Outcome::Kind::Failed;
        outcome.detail = e.what();
    }
    if (outcome.kind == Outcome::Kind::Failed && outcome.cells.empty()) {
        CellResult cell;
        cell.cell = "case";
        cell.detail = outcome.detail;
        outcome.cells.push_back(cell);
    }
    outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return outcome;
}

Json to_json(size_t index, const Outcome& outcome) {
    Json cells = Json::array();
    for (const CellResult& cell : outcome.cells)
        cells.push_back(
            {{"cell", cell.cell}, {"passed", cell.passed}, {"detail", cell.detail}, {"known", cell.known}});
    return {{"index", index},
            {"kind", int(outcome.kind)},
            {"detail", outcome.detail},
            {"cells", cells},
            {"seconds", outcome.seconds}};
}

// A driver that lost its device answers nothing any more in this process.
bool lost_device(const Outcome& outcome) {
    return outcome.kind == Outcome::Kind::Failed && outcome.detail.find("DEVICE_LOST") != std::string::npos;
}

constexpr int kLost = 4;  // the child's exit status then

// The child's work: tasks from `first` on, one line of JSON each.
[[noreturn]] void child(const std::vector<Task>& tasks, size_t first, const SuiteOptions& options, int out) {
    std::map<Backend, std::unique_ptr<Host>> hosts;
    auto host_of = [&](Backend backend) -> Host& {
        auto& host = hosts[backend];
        if (!host) {
            Host::Options device = options.host;
            device.print_device = false;
            std::set<Backend> backends{backend};
            if (options.compare) backends.insert(Backend::Khr);
            host = std::make_unique<Host>(backends, device);
        }
        return *host;
    };
    for (size_t i = first; i < tasks.size(); ++i) {
        std::string line = "{\"start\": " + std::to_string(i) + "}\n";
        if (write(out, line.data(), line.size()) < 0) _exit(3);
        const Outcome outcome = run_one(tasks[i], options, host_of);
        line = to_json(i, outcome).dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
        for (size_t at = 0; at < line.size();) {
            ssize_t wrote = write(out, line.data() + at, line.size() - at);
            if (wrote <= 0) _exit(3);
            at += size_t(wrote);
        }
        if (lost_device(outcome)) _exit(kLost);
    }
    hosts.clear();
    _exit(0);
}

}  // namespace

int run_suite(const SuiteOptions& options) {
    std::vector<Task> tasks;
    for (const std::string& file : suite_files(options.folder, options.filter))
        for (const std::string& variant : options.variants) tasks.push_back({file, variant});
    if (options.shards > 1) {  // neighbours, which cost alike, go to different shards
        size_t kept = 0;
        for (size_t i = options.shard; i < tasks.size(); i += options.shards) tasks[kept++] = tasks[i];
        tasks.resize(kept);
        if (tasks.empty()) {  // fewer cases than shards
            if (!options.json.empty()) std::ofstream(options.json) << "[]\n";
            return 0;
        }
    }
    if (tasks.empty()) throw Error("no case fits '" + options.filter + "' under " + options.folder);
    if (options.list) {
        for (const Task& task : tasks) std::printf("%s [%s]\n", task.file.c_str(), task.variant.c_str());
        return 0;
    }
    if (options.host.print_device) {
        Host::Options only = options.host;
        only.validate = false;
        // The device is opened in a child too: some drivers do not survive a fork of a process that holds
        // them.
        std::fflush(stdout);
        pid_t pid = fork();
        if (pid == 0) {
            int status = 0;
            try {
                std::set<Backend> backends;
                if (options.compare) backends.insert(Backend::Khr);
                for (const std::string& variant : options.variants)
                    if (variant_of(variant).backend != Backend::Rtc)
                        backends.insert(variant_of(variant).backend);
                Host host(backends, only);
            } catch (const std::exception& e) {
                std::fprintf(stderr, "rtc-run: error: %s\n", e.what());
                status = 1;
            }
            std::fflush(stdout);
            _exit(status);
        }
        int status = 0;
        waitpid(pid, &status, 0);
        if (!WIFEXITED(status) || WEXITSTATUS(status)) return 1;
    }

    std::vector<Outcome> outcomes(tasks.size());
    std::vector<bool> done(tasks.size());
    size_t next = 0;
    const auto begin = std::chrono::steady_clock::now();
    // Milliseconds until the whole suite must end; far away when no limit was given.
    auto left = [&] {
        if (!options.limit_seconds) return 1000000000.0;
        return options.limit_seconds * 1e3 -
               std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    };
    while (next < tasks.size() && left() > 0) {
        const size_t first = next;
        int ends[2];
        if (pipe(ends)) throw Error("pipe failed");
        std::fflush(nullptr);
        pid_t pid = fork();
        if (pid < 0) throw Error("fork failed");
        if (pid == 0) {
            close(ends[0]);
            child(tasks, next, options, ends[1]);
        }
        close(ends[1]);
        std::string text;
        size_t running = next;
        bool timed_out = false, out_of_time = false;
        for (;;) {
            pollfd wait{ends[0], POLLIN, 0};
            const double patience = options.timeout_seconds * 1e3;
            int ready = poll(&wait, 1, int(std::max(0.0, std::min(patience, left()))));
            if (ready == 0) {
                (left() <= 0 ? out_of_time : timed_out) = true;
                kill(pid, SIGKILL);
                break;
            }
            char chunk[65536];
            ssize_t got = read(ends[0], chunk, sizeof(chunk));
            if (got <= 0) break;
            text.append(chunk, size_t(got));
            for (size_t newline; (newline = text.find('\n')) != std::string::npos;
                 text.erase(0, newline + 1)) {
                Json line = Json::parse(text.substr(0, newline));
                if (line.contains("start")) {
                    running = line["start"].get<size_t>();
                    continue;
                }
                size_t index = line["index"].get<size_t>();
                Outcome& outcome = outcomes[index];
                outcome.kind = Outcome::Kind(line["kind"].get<int>());
                outcome.detail = line["detail"].get<std::string>();
                outcome.seconds = line["seconds"].get<double>();
                for (const Json& cell : line["cells"])
                    outcome.cells.push_back({cell["cell"].get<std::string>(), cell["passed"].get<bool>(),
                                             cell["detail"].get<std::string>(),
                                             cell["known"].get<std::string>()});
                done[index] = true;
                running = index + 1;
                if (lost_device(outcome) && index != first) continue;  // judged again below
                if (outcome.kind == Outcome::Kind::Failed || options.verbose)
                    std::printf("%s %s [%s] %.2f s%s%s\n",
                                outcome.kind == Outcome::Kind::Failed    ? "FAIL"
                                : outcome.kind == Outcome::Kind::Skipped ? "skip"
                                : outcome.kind == Outcome::Kind::Passed  ? "pass"
                                                                         : "n/a ",
                                std::filesystem::relative(tasks[index].file, options.folder).c_str(),
                                tasks[index].variant.c_str(), outcome.seconds,
                                outcome.detail.empty() ? "" : "\n     ", outcome.detail.c_str());
                std::fflush(stdout);
            }
        }
        close(ends[0]);
        int status = 0;
        waitpid(pid, &status, 0);
        if (WIFEXITED(status) && WEXITSTATUS(status) == kLost && running > next) {
            // The case that lost the device, or one before it: it runs again, first in a new process. What
            // loses the device there has lost it itself.
            next = running - 1 == first ? running : running - 1;
            if (next < running) {
                done[next] = false;
                std::printf("lost the device by %s [%s] or a case before; again\n",
                            std::filesystem::relative(tasks[next].file, options.folder).c_str(),
                            tasks[next].variant.c_str());
            }
            continue;
        }
        if (running >= tasks.size() || out_of_time) break;
        // It died in `running`. A native driver that cannot finish (lavapipe 25 takes minutes to compile some
        // loops around traces) says nothing about rtc: that is a skip with its reason.
        Outcome& outcome = outcomes[running];
        bool native = variant_of(tasks[running].variant).backend != Backend::Rtc;
        outcome.kind = timed_out && native ? Outcome::Kind::Skipped : Outcome::Kind::Failed;
        outcome.detail = timed_out ? "no answer within " + std::to_string(options.timeout_seconds) + " s"
                         : WIFSIGNALED(status)
                             ? std::string("crashed: ") + strsignal(WTERMSIG(status))
                             : "ended with status " + std::to_string(WEXITSTATUS(status));
        if (outcome.kind == Outcome::Kind::Failed) outcome.cells = {{"case", false, outcome.detail, ""}};
        std::printf("%s %s [%s]\n     %s\n", outcome.kind == Outcome::Kind::Failed ? "FAIL" : "skip",
                    std::filesystem::relative(tasks[running].file, options.folder).c_str(),
                    tasks[running].variant.c_str(), outcome.detail.c_str());
        done[running] = true;
        next = running + 1;
    }
    for (size_t i = 0; i < tasks.size(); ++i) {
        if (done[i]) continue;
        outcomes[i] = {Outcome::Kind::Skipped, "out of time", {}, 0};
        std::printf("skip %s [%s]\n     out of time\n",
                    std::filesystem::relative(tasks[i].file, options.folder).c_str(), tasks[i].variant.c_str());
    }

    struct Count {
        int passed = 0, failed = 0, skipped = 0, cells_passed = 0, cells_failed = 0, cells_known = 0;
    };
    std::map<std::string, std::map<std::string, Count>> groups;  // group -> variant
    std::map<std::string, Count> total;
    Json report = Json::array();
    for (size_t i = 0; i < tasks.size(); ++i) {
        const Outcome& outcome = outcomes[i];
        std::string relative = std::filesystem::relative(tasks[i].file, options.folder).string();
        std::string group = relative.substr(0, relative.find('/'));
        for (Count* count : {&groups[group][tasks[i].variant], &total[tasks[i].variant]}) {
            if (outcome.kind == Outcome::Kind::Passed) ++count->passed;
            if (outcome.kind == Outcome::Kind::Failed) ++count->failed;
            if (outcome.kind == Outcome::Kind::Skipped) ++count->skipped;
            for (const CellResult& cell : outcome.cells)
                ++(cell.passed          ? count->cells_passed
                   : cell.known.empty() ? count->cells_failed
                                        : count->cells_known);
        }
        if (outcome.kind != Outcome::Kind::NotApplicable) {
            Json entry = to_json(i, outcome);
            entry.erase("index");
            entry["case"] = relative;
            entry["variant"] = tasks[i].variant;
            entry["kind"] = outcome.kind == Outcome::Kind::Passed    ? "passed"
                            : outcome.kind == Outcome::Kind::Skipped ? "skipped"
                                                                     : "failed";
            report.push_back(std::move(entry));
        }
    }
    std::printf("\n%-24s", "group (cells passed)");
    for (const std::string& variant : options.variants) std::printf("%16s", variant.c_str());
    std::printf("\n");
    auto row = [&](const std::string& name, std::map<std::string, Count>& counts) {
        std::printf("%-24s", name.c_str());
        for (const std::string& variant : options.variants) {
            const Count& c = counts[variant];
            char text[48];
            int all = c.cells_passed + c.cells_failed + c.cells_known;
            if (c.cells_known)  // a driver's recorded deviations
                std::snprintf(text, sizeof(text), "%d(+%d)/%d", c.cells_passed, c.cells_known, all);
            else
                std::snprintf(text, sizeof(text), "%d/%d", c.cells_passed, all);
            std::printf("%16s", text);
        }
        std::printf("\n");
    };
    for (auto& [group, counts] : groups) row(group, counts);
    row("all", total);
    int passed = 0, failed = 0, skipped = 0;
    for (const auto& [variant, count] : total) {
        passed += count.passed;
        failed += count.failed;
        skipped += count.skipped;
    }
    if (!options.json.empty()) std::ofstream(options.json) << report.dump(1) << "\n";
    std::printf("%d passed, %d failed%s\n", passed, failed,
                skipped ? (", " + std::to_string(skipped) + " skipped").c_str() : "");
    return failed ? 1 : 0;
}

}  // namespace rtc::run
