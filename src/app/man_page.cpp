#include "app/man_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <sstream>
#include <string_view>
#include <vector>

namespace knap::app {

namespace {

/// Text as roff shows it unchanged: a minus that can be copied, no control characters.
std::string escape(std::string_view text) {
    std::string result;
    if (text.starts_with('.') || text.starts_with('\'')) {
        result = "\\&";
    }
    for (const char c : text) {
        if (c == '-') {
            result += "\\-";
        } else if (c == '\\') {
            result += "\\e";
        } else {
            result += c;
        }
    }
    return result;
}

std::string bold(std::string_view text) {
    return "\\fB" + escape(text) + "\\fR";
}

std::string italic(std::string_view text) {
    return "\\fI" + escape(text) + "\\fR";
}

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) {
        lines.push_back(line);
    }
    return lines;
}

/// Facts in brackets, and "name: what it means", keep a line of their own; the rest flows.
bool begins_line(const std::string& line) {
    const auto end = std::find_if(line.begin(), line.end(),
                                  [](unsigned char c) { return std::isalnum(c) == 0; });
    const bool is_name = end != line.begin() && end != line.end() && *end == ':';
    return line.starts_with("[") || is_name;
}

std::string flowing(const std::string& text) {
    std::string result;
    bool first = true;
    for (const std::string& line : lines_of(text)) {
        result += (!first && begins_line(line) ? ".br\n" : "") + escape(line) + "\n";
        first = false;
    }
    return result;
}

/// Paragraphs, and between them indented lines as they are.
std::string with_examples(const std::string& text) {
    std::string result;
    bool literal = false;
    for (const std::string& line : lines_of(text)) {
        const bool is_example = line.starts_with("  ");
        if (is_example != literal) {
            result += is_example ? ".nf\n.RS 2\n" : ".RE\n.fi\n";
            literal = is_example;
        }
        if (line.empty()) {
            result += ".PP\n";
        } else {
            result += escape(is_example ? line.substr(2) : line) + "\n";
        }
    }
    return result + (literal ? ".RE\n.fi\n" : "");
}

std::string positional_name(const CLI::Option& option) {
    return option.get_name(true) + (option.get_expected_max() > 1 ? " ..." : "");
}

std::string entry(const CLI::Option& option) {
    std::string head;
    for (const std::string& name : flag_names(option)) {
        head += (head.empty() ? "" : ", ") + bold(name);
    }
    if (head.empty()) {
        head = italic(positional_name(option));
    }
    if (!option.get_type_name().empty() && option.get_expected_max() > 0) {
        head += " " + italic(option.get_type_name());
    }
    return ".TP\n" + head + "\n" + flowing(option.get_description());
}

std::string entries(const CLI::App& app, const std::string& group) {
    std::string result;
    for (const CLI::Option* option : app.get_options()) {
        if (option->get_group() == group) {
            result += entry(*option);
        }
    }
    return result;
}

std::string command_section(const CLI::App& command) {
    std::string positionals;
    for (const CLI::Option* option : command.get_options()) {
        if (option->get_positional()) {
            positionals += " " + italic(positional_name(*option));
        }
    }
    std::string result =
        fmt::format(".SS \"knap {}\"\n{} [{}]{}\n.PP\n{}", escape(command.get_name()),
                    bold("knap " + command.get_name()), italic("OPTIONS"), positionals,
                    flowing(command.get_description()));
    for (const std::string& group : command.get_groups()) {
        if (group != "Options" && !group.empty()) {
            result += fmt::format(".PP\n{}:\n", italic(group));
        }
        result += entries(command, group);
    }
    const std::string footer = command.get_footer();
    return result + (footer.empty() ? "" : ".PP\n" + with_examples(footer));
}

}  // namespace

std::string man_page(const Program& program, const std::string& version) {
    // The first line is the name and what it stands for, as in every page of section 1.
    const std::string about = program.root->get_description();
    const std::size_t colon = about.find(": ");
    const std::size_t end = about.find('\n');
    std::string page = fmt::format(".TH KNAP 1 \"\" \"knap {}\" \"User Commands\"\n", version);
    page +=
        fmt::format(".SH NAME\nknap \\- {}\n", escape(about.substr(colon + 2, end - colon - 3)));
    page += fmt::format(".SH SYNOPSIS\n{} {} [{}]\n.br\n{}\n", bold("knap"), italic("COMMAND"),
                        italic("OPTIONS"), bold("knap --version"));
    page += ".SH DESCRIPTION\n" + flowing(about.substr(end + 1));
    page += ".SH COMMANDS\n";
    for (const Command& command : program.commands) {
        page += command_section(*command.parser);
    }
    page += ".SH EXAMPLES\n" + with_examples(program.examples);
    page += ".SH EXIT STATUS\n" + flowing(program.statuses);
    return page;
}

}  // namespace knap::app
