//! How QGIS shows the rasters of `maps/`: a `.qml` of the same name beside each, which it takes by itself.
//!
//! Source: QGIS 3 writes such files ("Save Style"); what is left out here has its own default.

use super::picture::{COLOURS, ColourScale, colour, extremes};
use toolkit::numbers::three;

/// Steps between two of the colours: QGIS interpolates evenly between them.
const STEPS: usize = 4;

/// Of a raster with these values: the colours of its picture, spread in the same way.
pub fn of_raster(scale: ColourScale, values: &[f32]) -> String {
    let [least, most] = extremes(scale, values);
    let count = STEPS * (COLOURS.len() - 1);
    let item = |step: usize| {
        let at = step as f64 / count as f64;
        let value = match scale {
            ColourScale::Linear => least + at * (most - least),
            ColourScale::Log => least * (most / least).powf(at),
        };
        let [r, g, b] = colour(at);
        let label = three(value);
        format!(
            "<item value=\"{value}\" label=\"{label}\" color=\"#{r:02x}{g:02x}{b:02x}\" alpha=\"255\"/>\n"
        )
    };
    // Where all values are equal there is one colour, as in the picture.
    let first = if most > least { 0 } else { count };
    let items: String = (first..=count).map(item).collect();
    format!(
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n<qgis version=\"3.22\" styleCategories=\"Symbology\">\n<pipe>\n\
         <rasterrenderer type=\"singlebandpseudocolor\" band=\"1\" opacity=\"0.85\" alphaBand=\"-1\" nodataColor=\"\" \
         classificationMin=\"{least}\" classificationMax=\"{most}\">\n<rastershader>\n\
         <colorrampshader colorRampType=\"INTERPOLATED\" classificationMode=\"1\" clip=\"0\" minimumValue=\"{least}\" \
         maximumValue=\"{most}\">\n{items}</colorrampshader>\n</rastershader>\n</rasterrenderer>\n</pipe>\n\
         <blendMode>0</blendMode>\n</qgis>\n"
    )
}
