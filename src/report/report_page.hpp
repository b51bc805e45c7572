#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "knap/job.hpp"
#include "report/colour_map.hpp"
#include "report/curvature_histogram.hpp"
#include "store/source_table.hpp"

namespace knap {

/// One view of the cloud, before and after: PNG files of one size.
struct ReportView {
    std::string name;
    int width = 0;  ///< pixels
    int height = 0;
    std::vector<std::byte> all;   ///< all points
    std::vector<std::byte> kept;  ///< the kept points as a surface
    std::vector<std::byte> dots;  ///< the kept points as dots
};

/// What a report shows.
struct ReportPage {
    const Job& job;  ///< alpha as it was given or found
    const Report& report;
    const SourceTable& sources;
    CurvatureScale scale;
    CurvatureHistogram all;
    CurvatureHistogram kept;
    CurvatureColours colours;                ///< of the pictures
    std::function<double(double)> range_of;  ///< of a curvature |H|, cloud units
    std::vector<ReportView> views;
};

/// A report as one HTML page that needs nothing but itself. All that may differ between two runs
/// of one job stands in its last section, between two comments.
std::string format_report_page(const ReportPage& page);

/// The style sheet of the page.
std::string_view report_style();

/// What a job cost, the last section.
std::string format_cost_section(const ReportPage& page);

/// Sources and parameters.
std::string format_source_section(const SourceTable& sources);
std::string format_parameter_section(const Job& job);

/// Rows of a table: keys beginning with `resources.` or not.
std::string format_parameter_rows(const Job& job, bool resources);

}  // namespace knap
