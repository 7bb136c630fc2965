//! The atlas: as it was shipped, as OBJ and glTF, and its mask.

use std::sync::Arc;

use axum::{
    extract::State,
    http::{HeaderMap, Uri},
};
use papilla_codec::encode_mask;
use papilla_proto::{
    ErrorCode, Problem,
    atlas::{Patch, Raster},
};

use crate::{
    core::{
        cache::Content,
        catalogue::{Catalogue, Document},
    },
    problem,
    transport::{
        answer::{Answer, Shared, cached, refuse},
        app::App,
    },
};

pub(crate) async fn json(State(app): Shared, headers: HeaderMap) -> Answer {
    serve(&app, &headers, Document::Atlas, |catalogue| {
        Ok(Content::new("application/json", catalogue.atlas_json.clone()))
    })
    .await
}

pub(crate) async fn obj(State(app): Shared, headers: HeaderMap) -> Answer {
    serve(&app, &headers, Document::AtlasObj, |catalogue| {
        Ok(Content::new("model/obj", catalogue.atlas.to_obj()))
    })
    .await
}

/// Both patches as binary glTF, each with its mask as a texture.
pub(crate) async fn glb(State(app): Shared, headers: HeaderMap) -> Answer {
    serve(&app, &headers, Document::AtlasGlb, |catalogue| {
        let masks = [png(&catalogue.skin)?, png(&catalogue.interface)?];
        Ok(Content::new("model/gltf-binary", catalogue.atlas.to_glb(&masks)))
    })
    .await
}

/// White where the patch is: the interface, or with `?patch=skin` the skin.
pub(crate) async fn mask(State(app): Shared, uri: Uri, headers: HeaderMap) -> Answer {
    let patch = match uri.query() {
        None | Some("" | "patch=interface") => Patch::Interface,
        Some("patch=skin") => Patch::Skin,
        Some(_) => {
            let message = "the parameter is patch=interface or patch=skin";
            return refuse(&app, Problem::new(ErrorCode::BadQuery, message).at("patch"));
        }
    };
    serve(&app, &headers, Document::Mask(patch), move |catalogue| {
        let raster = match patch {
            Patch::Skin => &catalogue.skin,
            Patch::Interface => &catalogue.interface,
        };
        Ok(Content::new("image/png", png(raster)?))
    })
    .await
}

fn png(raster: &Raster) -> Result<Vec<u8>, Problem> {
    let mut png = Vec::new();
    encode_mask(raster.mask(), &mut png)
        .map_err(|error| problem::internal("the mask cannot be encoded", &error))?;
    Ok(png)
}

async fn serve(
    app: &App,
    headers: &HeaderMap,
    document: Document,
    make: impl FnOnce(&Catalogue) -> Result<Content, Problem> + Send + 'static,
) -> Answer {
    let catalogue = app.catalogue();
    let of = Arc::clone(&catalogue);
    let made = cached(&catalogue.cache, headers, document, move || make(&of)).await;
    made.or_else(|problem| refuse(app, problem))
}
